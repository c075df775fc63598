"""The painted recordings, once for all tests."""

from __future__ import annotations

import pytest
from lsds_research.slips.outputs import watch
from lsds_research.slips.recording_view import RecordingView
from research.slips.slid import SLIDE, STICK, TURN, paint


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """The folder; nothing may be written to it."""
    return paint(tmp_path_factory.mktemp("slid"))


@pytest.fixture(scope="session")
def outputs(recordings):
    """Outputs of detector and estimator `imprint` for each recording, by name."""
    return {name: watch(recordings / name, ["imprint"], ["imprint"]) for name in (SLIDE, STICK, TURN)}


@pytest.fixture(scope="session")
def seen(recordings):
    """Two of them as a labeller sees them, by name."""
    return {name: RecordingView(recordings / name) for name in (SLIDE, STICK)}
