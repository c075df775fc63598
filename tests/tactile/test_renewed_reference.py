"""A recording whose first frames show another state of the gel: the change is detected, reported and repaired."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from tactile.imprinted import HEIGHT, PITCH, WIDTH, Motion, bumps, painted

from lsds.runtime.finger_pipeline import LEAP_FRAMES
from lsds.session.track import track

FLAT = bumps() * 0


def written(folder: Path, motions: list[Motion]) -> Path:
    folder.mkdir()
    for number, gel in enumerate(motions):
        image = painted(FLAT, Motion(), gel, seq=number).image
        cv2.imwrite(str(folder / f"{number:03}.png"), image[..., ::-1])
    return folder


def test_a_gel_that_leaps_is_followed_from_a_new_reference(tmp_path: Path) -> None:
    leapt = Motion(PITCH / 2, PITCH / 2)
    found = track(written(tmp_path / "leap", [Motion()] * 4 + [leapt] * (LEAP_FRAMES + 12)))
    assert found.error is None
    assert len(found.renewed) == 1
    first = found.renewed[0]
    assert 4 + LEAP_FRAMES <= first < 4 + LEAP_FRAMES + 3
    assert found.summary()["reference_renewed"] == found.renewed
    # From then on all dots are followed again.
    assert np.mean(found.kept_fraction[-8:]) > 0.99


def test_a_gel_that_only_moves_keeps_its_reference(tmp_path: Path) -> None:
    slow = [Motion(0.8 * number, -0.4 * number) for number in range(LEAP_FRAMES + 8)]
    found = track(written(tmp_path / "slow", slow))
    assert found.renewed == []
    assert np.mean(found.kept_fraction) > 0.9


def test_nothing_to_take_it_from_is_no_end(tmp_path: Path) -> None:
    folder = written(tmp_path / "blank", [Motion()] * 4)
    rng = np.random.default_rng(0)
    for number in range(4, LEAP_FRAMES + 14):
        image = np.clip(110 + 3 * rng.standard_normal((HEIGHT, WIDTH, 3)), 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"{number:03}.png"), image)
    found = track(folder)
    assert found.error is None
    assert found.renewed == []
    assert found.frames == LEAP_FRAMES + 14
