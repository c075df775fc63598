import itertools

import numpy as np
import pytest
from mock_rig import MS, WEAK_M, make_rig

from lsds.contracts import Lifecycle, TactileSensor
from lsds.errors import LifecycleError, StaleData


def stream(rig, until_ms, every_ms=5):
    """Return each frame read with the time of the read that first showed it."""
    seen = {}
    for t_ms in np.arange(rig.clock.now() / MS + every_ms, until_ms, every_ms):
        rig.until(float(t_ms))
        try:
            frame = rig.sensor.read()
        except StaleData:
            continue
        seen.setdefault(frame.seq, (rig.clock.now(), frame))
    return seen


def test_it_is_a_tactile_sensor():
    sensor = make_rig().sensor
    assert isinstance(sensor, TactileSensor)
    assert sensor.spec.rate_hz == 25
    assert sensor.spec.pad == (7, 9)
    assert sensor.spec.metres_per_px == pytest.approx(62.5e-6)


def test_frames_come_at_25_hz_with_jitter_and_latency():
    seen = stream(make_rig(), 8000, every_ms=1)
    assert list(seen) == list(range(len(seen)))
    times = np.array([frame.t_ns for _, frame in seen.values()]) / 1e6
    intervals = np.diff(times)
    assert intervals.mean() == pytest.approx(40, abs=0.1)
    assert 1.0 < intervals.std() < 4.0
    latency = np.array([now - frame.t_ns for now, frame in seen.values()]) / 1e6
    assert latency.min() >= 25
    assert 26 < np.median(latency) < 29


def test_nothing_before_the_first_frame():
    rig = make_rig()
    rig.until(110)
    with pytest.raises(StaleData, match="no frame"):
        rig.sensor.read()


def test_the_same_frame_again_until_a_newer_one_comes():
    rig = make_rig()
    rig.until(300)
    assert rig.sensor.read() is rig.sensor.read()


def test_what_is_read_does_not_change_what_comes():
    often, seldom = make_rig(2), make_rig(2)
    for rig in (often, seldom):
        rig.until(100)
        rig.grip(WEAK_M)
    stream(often, 900, every_ms=3)
    often.until(900)
    seldom.until(900)
    a, b = often.sensor.read(), seldom.sensor.read()
    assert (a.seq, a.t_ns) == (b.seq, b.t_ns)
    assert np.array_equal(a.image, b.image)


def test_dropped_frames_leave_gaps():
    seen = stream(make_rig(sensor={"drop_probability": 0.3}), 4000)
    assert 0.15 < 1 - len(seen) / (max(seen) + 1) < 0.45


def test_duplicates_repeat_the_image_under_a_new_stamp():
    frames = [frame for _, frame in stream(make_rig(sensor={"duplicate_probability": 0.3}), 3000).values()]
    repeats = [np.array_equal(a.image, b.image) for a, b in itertools.pairwise(frames)]
    assert 0.15 < np.mean(repeats) < 0.45
    assert all(b.t_ns > a.t_ns and b.seq > a.seq for a, b in itertools.pairwise(frames))


def test_frozen_camera_goes_on_stamping_one_image():
    frames = [frame for _, frame in stream(make_rig(sensor={"freeze_at_s": 0.5}), 1200).values()]
    late = [frame for frame in frames if frame.t_ns > 550 * MS]
    assert len(late) > 10
    assert all(np.array_equal(frame.image, late[0].image) for frame in late)


def test_silent_camera_turns_stale():
    rig = make_rig(sensor={"silent_at_s": 0.5, "stale_after_ms": 200})
    rig.until(600)
    last = rig.sensor.read()
    assert last.t_ns < 500 * MS
    rig.until(800)
    with pytest.raises(StaleData, match="ms old"):
        rig.sensor.read()


def test_exposure_between_steps_is_interpolated():
    # Bristles do not care for the length of a step, so that what differs is the instant of the exposure.
    fine, coarse = (make_rig(cell={"step_ms": ms, "fidelity": "winkler"}) for ms in (1.0, 4.0))
    for rig in (fine, coarse):
        rig.until(100)
        rig.grip(0.0215)
        rig.until(1200)
        rig.lift(0.02, acceleration=10)
        rig.until(1290)
    a, b = (rig.sensor.marker_truth(29) for rig in (fine, coarse))
    assert a.t_ns == b.t_ns > 1200 * MS
    assert np.abs(a.xy_px - a.rest_px).max() > 0.5
    assert np.abs(a.xy_px - b.xy_px).max() < 0.35


def test_marker_truth_of_earlier_frames_and_of_now():
    rig = make_rig()
    with pytest.raises(LookupError):
        rig.sensor.marker_truth()
    rig.until(500)
    frame = rig.sensor.read()
    assert rig.sensor.marker_truth(frame.seq - 2).seq == frame.seq - 2
    now = rig.truth_now()
    assert now.t_ns == 500 * MS
    assert now.contact_fraction == 0
    assert np.array_equal(now.xy_px, now.rest_px)
    with pytest.raises(LookupError):
        rig.sensor.marker_truth(10_000)


def test_lifecycle():
    rig = make_rig(ready=False)
    sensor = rig.sensor
    with pytest.raises(LifecycleError):
        sensor.read()
    sensor.connect()
    sensor.stop()
    sensor.stop()
    rig.until(300)
    sensor.read()
    sensor.close()
    sensor.close()
    sensor.stop()
    assert sensor.lifecycle is Lifecycle.CLOSED
    with pytest.raises(LifecycleError):
        sensor.read()
