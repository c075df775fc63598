"""Long runs stay small without losing a peak."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from lsds.session.recording.report import images
from lsds.session.recording.report.curves import MOST_POINTS, Curve
from lsds.session.recording.report.images import MOST_CHARACTERS, ThinnedImages
from lsds.session.recording.report.tables import MOST_CORRECTIONS, listed


def stored(width=320, height=240, seed=0):
    noise = np.random.default_rng(seed).integers(0, 256, (height // 4, width // 4, 3), np.uint8)
    return cv2.imencode(".png", cv2.resize(noise, (width, height)))[1].tobytes()


def test_images_of_ten_minutes_stay_below_the_limit_and_evenly_spaced(monkeypatch):
    kept = ThinnedImages()
    monkeypatch.setattr(images, "_url", lambda data: data.decode() * 8500)
    for number in range(600 * 25):
        kept.add(number / 25, b"x")
        assert sum(map(len, kept.urls[-1:])) <= MOST_CHARACTERS
    assert sum(map(len, kept.urls)) <= MOST_CHARACTERS
    assert kept.step > 1
    steps = np.diff(kept.t_s)
    assert steps == pytest.approx(kept.step / 25)
    assert kept.t_s[-1] > 600 - 2 * kept.step / 25
    assert f"one image in {kept.step}" in kept.thinning


def test_a_large_image_is_made_smaller_and_a_damaged_one_does_no_harm():
    kept = ThinnedImages()
    kept.add(0.0, stored(640, 480))
    kept.add(0.1, b"no image")
    kept.add(0.2, stored())
    assert kept.unreadable == 1
    assert [bool(url) for url in kept.urls] == [True, False, True]
    import base64

    data = base64.b64decode(kept.urls[0].removeprefix("data:image/jpeg;base64,"))
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape == (240, 320, 3)


def test_a_long_curve_keeps_peaks_and_gaps():
    curve = Curve()
    for number in range(10 * MOST_POINTS):
        curve.add(number / 100, math.nan if 5000 <= number < 6000 else math.sin(number / 700))
    curve.values[77_777], curve.values[33_333] = 9.0, -9.0
    thin = curve.thinned()
    assert len(thin.values) <= MOST_POINTS
    assert (max(v for v in thin.values if v == v), min(v for v in thin.values if v == v)) == (9.0, -9.0)
    assert thin.t_s == sorted(thin.t_s)
    assert {t for t, v in zip(thin.t_s, thin.values, strict=True) if v != v} <= {n / 100 for n in range(5000, 6000)}
    assert any(math.isnan(value) for value in thin.values)
    assert curve.thinned(most=10 * MOST_POINTS) is curve


def test_a_list_of_many_corrections_is_short_and_keeps_everything_else():
    from types import SimpleNamespace

    from lsds.session.recording.report.gather import Happening

    many = [Happening(float(n), "correction", "") for n in range(MOST_CORRECTIONS + 50)]
    rest = [Happening(1e6, "fault", "lost")]
    kept, note = listed(SimpleNamespace(happenings=[*many, *rest]))
    assert (len(kept), kept[-1]) == (MOST_CORRECTIONS + 1, rest[0])
    assert note.startswith("50 later corrections")
