"""The delay margin of the linear loop: a double integrator with a zero, against its closed form."""

from __future__ import annotations

import pytest
from lsds_research.stability.delay_margin import delay_margin_s
from lsds_research.stability.maps.loop_delay import remarks

pytest.importorskip("control", reason="python-control is not installed: pip install '.[search]'")


@pytest.mark.parametrize("gain", [0.1, 1.0, 1.5])
def test_a_double_integrator_with_a_zero_has_the_margin_of_its_zero(gain):
    # At low gain the phase margin is w kd / kp, so the delay margin is kd / kp: 0.42 * 0.04 s / 3.1.
    assert delay_margin_s(gain) <= 0.42 * 0.04 / 3.1
    assert delay_margin_s(gain / 100) == pytest.approx(0.42 * 0.04 / 3.1, rel=0.01)
    assert delay_margin_s(2 * gain) < delay_margin_s(gain)


def test_the_map_states_it():
    (remark,) = remarks()
    assert "delay margin of" in remark
