"""Windows offline and online are the same; a signal is picked alike from the whole vector and by name."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_research.datasets import Dataset, from_rows, joined
from lsds_research.windows import windows
from research.frames import observations

from lsds.errors import DataError
from lsds.models.signals import (
    EVIDENCE,
    IMPRINT,
    NUISANCES,
    SIGNAL_SETS,
    SIGNALS,
    UNITS,
    Picker,
    signal_indices,
    signal_names,
    signals_of,
)
from lsds.models.window import Window
from lsds.tactile.feature_sets import NAMES

SEEN = observations(25, lose=(7, 8))


def recording(name, values):
    signals = np.zeros((len(values), len(SIGNALS)), np.float32)
    signals[:, : values.shape[1]] = values
    return from_rows(name, "o", "p", np.arange(len(values)) * 0.04, signals, {})


@settings(max_examples=60)
@given(
    st.lists(st.lists(st.booleans(), min_size=1, max_size=12), min_size=1, max_size=5),
    st.integers(1, 6),
    st.integers(1, 4),
    st.integers(0, 1000),
)
def test_streaming_gives_the_windows_of_the_dataset(usable, length, width, seed):
    rng = np.random.default_rng(seed)
    recordings = []
    for own in usable:
        values = rng.standard_normal((len(own), width)).astype(np.float32)
        values[~np.array(own), rng.integers(width)] = rng.choice([np.nan, np.inf])
        recordings.append(values)
    data = joined([recording(f"r{i}", v) for i, v in enumerate(recordings)], {})
    x, rows = windows(data, SIGNALS[:width], length)
    streamed, last, row = [], [], 0
    for values in recordings:
        window = Window(length, width)
        for frame in values:
            if np.isfinite(frame).all():
                window.push(frame.tolist())
                streamed.append(window.frames[0].copy())
                last.append(row)
            row += 1
    assert rows.tolist() == last
    assert x.shape == (len(last), length, width)
    assert x.dtype == np.float32
    assert np.array_equal(x, np.array(streamed, np.float32).reshape(x.shape))


def test_a_window_never_reaches_into_another_recording():
    data = joined([recording(n, np.full((3, 1), v, np.float32)) for n, v in (("a", 1), ("b", 2))], {})
    x, _ = windows(data, SIGNALS[:1], 4)
    assert [set(window.ravel().tolist()) for window in x] == [{1.0}] * 3 + [{2.0}] * 3


def test_reset_forgets_and_the_array_stays_the_same():
    window = Window(3, 2)
    frames = window.frames
    for value in (1.0, 2.0, 3.0, 4.0):
        window.push((value, -value))
    assert frames[0].tolist() == [[2, -2], [3, -3], [4, -4]]
    window.reset()
    window.push((9.0, 9.0))
    assert window.frames is frames
    assert (frames == 9).all()


def test_names_units_and_sets_hang_together():
    assert (*NAMES, *EVIDENCE, *IMPRINT, *NUISANCES) == SIGNALS
    assert set(UNITS) == set(SIGNALS)
    for name, signals in SIGNAL_SETS.items():
        assert len(set(signals)) == len(signals), name
        assert signal_names(name) == signals
        assert [SIGNALS[i] for i in signal_indices(name)] == list(signals)
        if name != "nuisance":
            # Rates of several frames need the time between them; the control measures the information in time alone.
            timed = {"dt"} if name.startswith("timed-field") else set()
            assert set(signals) & set(NUISANCES) == timed, "only the control looks at nuisances"


@settings(max_examples=60)
@given(st.lists(st.sampled_from([s for s in SIGNALS if s != "brightness"]), min_size=1, max_size=12, unique=True))
def test_a_picker_returns_the_values_of_the_whole_vector(names):
    picker = Picker(names)
    for observation in SEEN:
        whole = signals_of(observation)[signal_indices(names)]
        picked = picker(observation)
        if np.isfinite(whole).all():
            assert np.array_equal(np.array(picked, np.float32), whole)
        else:
            assert picked is None


def test_most_markers_lost_or_no_velocity_yet_is_no_frame_to_learn_from():
    picker = Picker("field")
    undefined = [i for i, observation in enumerate(SEEN) if picker(observation) is None]
    assert {0, 7, 8} <= set(undefined) <= {0, 7, 8, 9}


def test_the_nuisances_are_what_they_are_called():
    values = dict(zip(SIGNALS, signals_of(SEEN[3], brightness=101.5).tolist(), strict=True))
    assert values["kept"] == 1
    assert values["markers"] == 63
    assert values["brightness"] == 101.5
    assert values["dt"] == pytest.approx(SEEN[3].dt_s)
    assert values["contact_share"] == 1


@pytest.mark.parametrize(
    ("names", "match"),
    [
        ("feild", "unknown set"),
        (["v_net", "nope"], "unknown signal nope"),
        ([], "exactly once, got: none"),
        (["dt", "dt"], "exactly once, got: dt, dt"),
    ],
)
def test_signals_that_there_are_not(names, match):
    for ask in (signal_names, signal_indices, Picker):
        with pytest.raises(DataError, match=match):
            ask(names)


def test_a_dataset_without_a_usable_frame_has_no_windows():
    data = Dataset(recording("a", np.full((4, 1), np.nan, np.float32)))
    x, rows = windows(data, SIGNALS[:2], 3)
    assert x.shape == (0, 3, 2)
    assert len(rows) == 0
