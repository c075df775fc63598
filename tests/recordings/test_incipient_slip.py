"""Real GelSight Mini recordings (BSD-2, see the data's README): every one is followed, most dots are kept."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from lsds.cli.track_session import overview, track_many

DATA = Path(os.environ.get("LSDS_DATA", "")) / "incipient_slip"
pytestmark = pytest.mark.skipif(
    "LSDS_DATA" not in os.environ or not DATA.is_dir(),
    reason="needs real recordings: set LSDS_DATA to a folder that holds incipient_slip/",
)


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 25], ids=["all 240", "one in 25"])
def test_every_recording_is_followed_and_the_dots_are_kept(every):
    with (DATA / "index.csv").open(encoding="utf-8") as index:
        rows = list(csv.DictReader(index))[::every]
    assert {row["camera"] for row in rows} == {"cam0", "cam2"}
    assert {row["slip"] for row in rows} == {"0", "1"}
    videos = [str(DATA / row["video"]) for row in rows]
    results = list(track_many(videos, None, [], jobs=1))
    found = overview(results)
    assert found["recordings"] == len(videos)
    assert [r["error"] for r in results if r["error"]] == []
    assert found["markers_kept_median_60_or_more_dots"] >= 0.99
    by_source = {r["source"]: r for r in results}
    counted = np.array([int(row["reference_markers"]) for row in rows])
    ours = np.array([by_source[video]["markers"] for video in videos])
    # Ours leaves out dots that the border cuts; the index counts some of them.
    assert np.median(np.abs(ours - counted)) <= 1
    assert np.abs(ours - counted).max() <= 10
