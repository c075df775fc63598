"""The plant obeys its physical laws for any command."""

import math
import threading

from hypothesis import given, settings
from hypothesis import strategies as st
from mock_rig import make_rig

commands = st.lists(
    st.tuples(
        st.sampled_from(["grip", "lift", "stop"]),
        st.floats(0, 0.05),
        st.floats(-0.02, 0.2),
        st.integers(10, 400),
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=30)
@given(commands, st.integers(0, 5))
def test_laws_hold_under_any_commands(script, seed):
    rig = make_rig(seed)
    static, dropped, slid = 0.55 * 1.24, False, 0.0
    for call, aperture, speed, wait_ms in script:
        if call == "grip":
            rig.grip(aperture)
        elif call == "lift":
            rig.lift(speed)
        else:
            rig.gripper.stop()
            rig.arm.stop()
        rig.until(rig.clock.now() / 1e6 + wait_ms)
        truth = rig.cell.truth()
        assert all(map(math.isfinite, (truth.object_height_m, truth.normal_force_n, truth.tangential_force_n)))
        assert truth.object_height_m >= 0
        assert truth.normal_force_n >= 0
        assert truth.tangential_force_n <= static * truth.normal_force_n + 1e-9
        assert 0 <= truth.stick_ratio <= 1
        assert truth.slip_distance_m >= slid
        assert truth.dropped or not dropped
        if truth.supported:
            assert truth.object_height_m == 0
        dropped, slid = truth.dropped, truth.slip_distance_m


def test_stop_from_another_thread_while_time_goes_on():
    rig = make_rig()
    rig.until(100)
    rig.grip(0.01)
    rig.lift(0.05)
    thread = threading.Thread(target=lambda: [(rig.gripper.stop(), rig.arm.stop()) for _ in range(50)])
    thread.start()
    for t_ms in range(110, 800, 10):
        rig.until(t_ms)
    thread.join()
    rig.until(1500)
    assert rig.arm.read().tcp_twist.linear_m_s[2] == 0
    assert not rig.gripper.read().moving
