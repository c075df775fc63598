"""A folder of labelled recordings: its contents, the outputs for each recording, and the training data."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from lsds_research.make_models import training_part
from lsds_research.slips.folder import STILL_FRAMES_PER_USED, LabelledRecording, as_dataset, labels_of, read_folder
from lsds_research.slips.labels import NAME, Interval, State, write_labels
from lsds_research.slips.outputs import Outputs, find_recording, watch
from lsds_research.slips.refit import refitted, zero_shot
from lsds_research.slips.score import FIRST_FRAMES, LabelledOutputs, counted, travels
from research.slips.slid import COUNT, FIRST, LAST, SLIDE, STICK, TRAVEL_PX, TURN, TURN_DEG, copied, truth
from video_files import write_video

from lsds.errors import DataError
from lsds.models.signals import SIGNALS


@pytest.fixture
def folder(recordings, tmp_path):
    return copied(recordings, tmp_path / "own")


# -- outputs for a recording -------------------------------------------------------------------------------


def test_the_slide_and_the_turn_are_noticed_and_the_stick_raises_no_alarm(outputs):
    for name in (SLIDE, TURN):
        assert (outputs[name].slip["imprint"][FIRST : LAST + 1] == 1).all()
        assert (outputs[name].slip["imprint"][2:FIRST] == 0).all()
    values = outputs[STICK].slip["imprint"]
    assert (values[2:] == 0).all()
    assert outputs[STICK].moved_px[FIRST:].min() > 1.0, "the gel moves all the time"
    assert np.nanmax(outputs[STICK].score["imprint"]) < np.nanmin(outputs[SLIDE].score["imprint"][FIRST : LAST + 1])


def test_travel_and_turn_come_out_within_a_fifth(outputs):
    def error(name):
        own = outputs[name]
        nothing = np.full(COUNT, np.nan)
        slid = own.slid["imprint"]
        (found,) = travels(LabelledOutputs(truth()[name], nothing, own.moved_px, slid[:, :2], slid[:, 2]))
        return found

    assert error(SLIDE).off_px < 0.2 * TRAVEL_PX
    assert abs(error(TURN).off_deg) < 0.2 * TURN_DEG
    stuck = np.nansum(outputs[STICK].slid["imprint"], axis=0)
    assert np.hypot(*stuck[:2]) < 2
    assert abs(stuck[2]) < 2


def test_every_frame_has_its_row_and_the_reference_has_none(outputs):
    own = outputs[SLIDE]
    assert (own.name, own.count, own.setup) == (SLIDE, COUNT, "whole pad")
    assert own.signals.shape == (COUNT, len(SIGNALS))
    assert own.slid["imprint"].shape == (COUNT, 3)
    for values in (own.slip["imprint"], own.score["imprint"], own.slid["imprint"][:, 0]):
        assert np.isnan(values[0])
        assert np.isfinite(values[2:]).all()
    assert np.isfinite(own.moved_px).all()
    assert not own.redrawn.any(), "images have no key frames"


def test_a_pad_with_few_dots_in_view_is_zoomed_in(outputs):
    own = outputs[SLIDE]
    few = Outputs(own.name, own.count, 49, own.moved_px, own.redrawn, own.signals)
    assert (few.setup, own.setup) == ("zoomed pad", "whole pad")


def test_a_video_gives_the_outputs_of_its_images(recordings, outputs, tmp_path):
    images = [cv2.imread(str(file))[..., ::-1] for file in sorted((recordings / SLIDE).iterdir())]
    own = watch(write_video(tmp_path / "mug.v2.avi", images), ["imprint"], [])
    assert own.name == "mug.v2"
    assert np.array_equal(own.slip["imprint"], outputs[SLIDE].slip["imprint"], equal_nan=True)


def test_what_cannot_be_watched_is_one_reason_that_names_it(recordings, tmp_path):
    (tmp_path / "000.png").hardlink_to(recordings / SLIDE / "000.png")
    reason = watch(tmp_path, [], [])
    assert reason == f"{tmp_path}: no usable frame after the reference"
    (tmp_path / "001.png").write_bytes(b"no image")
    reason = watch(tmp_path, [], [])
    assert str(tmp_path) in reason
    assert "frame 1 cannot be read as an image" in reason


# -- what is in a folder -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mug", "mug.v2", "mug [1]", "mug*"])
def test_a_recording_is_found_by_its_name_and_no_other(tmp_path, name):
    deep = tmp_path / "a" / "b"
    deep.mkdir(parents=True)
    (deep / f"{name}.avi").touch()
    for other in (f"{name}2.avi", f"{name}.txt", f"{name}.csv"):
        (deep / other).touch()
    (deep / name).mkdir()
    assert find_recording(tmp_path, name) == deep / f"{name}.avi", "a folder without images is no recording"
    (deep / f"{name}.avi").unlink()
    assert find_recording(tmp_path, name) is None
    (deep / name / "1.PNG").touch()
    assert find_recording(tmp_path, name) == deep / name
    assert find_recording(tmp_path, name[:-1]) is None


def test_the_labels_are_the_file_given_then_the_folder_s_own_then_the_shipped_ones(folder, tmp_path):
    assert repr(labels_of(folder)) == repr(truth())
    write_labels(tmp_path / "few.csv", {"gone": [Interval(0, 9, State.FREE)], STICK: [Interval(0, 4, State.FREE)]})
    assert list(labels_of(folder, tmp_path / "few.csv")) == [STICK], "and of these those that are there"
    (folder / NAME).unlink()
    with pytest.raises(DataError, match=r"own: holds none of the recordings that .*incipient_slip\.csv labels"):
        labels_of(folder)
    (folder / SLIDE).rename(folder / "baseball__e1__cam0")
    assert list(labels_of(folder)) == ["baseball__e1__cam0"]


def test_a_missing_folder_is_an_error(tmp_path):
    with pytest.raises(DataError, match="gone: no such folder"):
        labels_of(tmp_path / "gone")


def test_recordings_come_in_order_with_the_objects_of_the_index_or_of_their_names(folder):
    ticks = []
    found, failures = read_folder(folder, truth(), tick=lambda *done: ticks.append(done))
    assert [own.outputs.name for own in found] == [SLIDE, STICK, TURN]
    assert {own.object for own in found} == {"mug"}
    assert ticks == [(1, 3), (2, 3), (3, 3)]
    assert failures == {}
    (folder / "index.csv").write_text(f"video,object\nvideos/{SLIDE}.avi,cup\n")
    found, _ = read_folder(folder, {SLIDE: truth()[SLIDE]})
    assert found[0].object == "cup"
    (folder / "index.csv").write_text("video\nmug.avi\n")
    with pytest.raises(DataError, match=r"index\.csv: cannot be read: .*columns video, object"):
        read_folder(folder, truth())


def test_a_recording_that_is_damaged_is_passed_over_and_none_at_all_is_an_error(folder):
    for name in (SLIDE, TURN):
        (folder / name / "000.png").unlink()
        (folder / name / "000.png").write_bytes(b"no image")
    found, failures = read_folder(folder, truth())
    assert [own.outputs.name for own in found] == [STICK]
    assert list(failures) == [SLIDE, TURN]
    assert "000.png: frame 0 cannot be read" in failures[SLIDE]
    with pytest.raises(DataError, match=r"none of its labelled recordings can be used; the first: .*frame 0 cannot"):
        read_folder(folder, {SLIDE: truth()[SLIDE]})


def test_labels_beyond_the_end_are_of_another_recording(folder):
    labels = truth() | {SLIDE: [*truth()[SLIDE], Interval(COUNT, COUNT + 5, State.SLIP)]}
    found, failures = read_folder(folder, labels)
    assert [own.outputs.name for own in found] == [STICK, TURN]
    assert list(failures) == [SLIDE]
    assert f"frames {COUNT} to {COUNT + 5} are labelled, but it has {COUNT} frames" in failures[SLIDE]
    labels[SLIDE] = [*truth()[SLIDE][:-1], Interval(LAST + 1, COUNT + 5, State.STICK)]
    assert len(read_folder(folder, labels)[0]) == 3, "the last interval may be open"


def test_the_name_of_a_recording_may_have_dots_and_brackets(folder):
    (folder / SLIDE).rename(folder / "mug.v2 [1]")
    labels = {"mug.v2 [1]": truth()[SLIDE]}
    write_labels(folder / NAME, labels)
    (own,), _ = read_folder(folder, labels_of(folder))
    assert own.outputs.name == "mug.v2 [1]"


# -- what a learner gets -----------------------------------------------------------------------------------


def test_a_dataset_has_all_that_slips_and_moves_and_some_that_is_still(outputs):
    own = [LabelledRecording("mug", truth()[name], outputs[name]) for name in (SLIDE, STICK)]
    data = as_dataset(own)
    assert data.card["figures_are"] == "measured"
    assert set(data["object"].tolist()) == {"mug"}
    slide, stick = data.where(data["recording"] == SLIDE), data.where(data["recording"] == STICK)
    assert np.flatnonzero(slide["slip"] == 1).tolist() == list(range(FIRST, LAST + 1))
    still = [*range(LAST + 2, COUNT)]
    assert np.flatnonzero(slide["slip"] == 0).tolist() == still[::STILL_FRAMES_PER_USED]
    assert np.flatnonzero(stick["slip"] == 1).size == 0
    assert {*range(FIRST, COUNT)} <= {*np.flatnonzero(stick["slip"] == 0).tolist()}
    assert (data["slip"][data["frame"] < FIRST_FRAMES] == -1).all()
    step = slide["imprint_slip"][FIRST : LAST + 1]
    assert step == pytest.approx(TRAVEL_PX / (LAST - FIRST + 1) * 6.25e-5, rel=0.2)


def made_up(name, thing, seed, sense=1.0, count=60):
    """A recording whose signals are large during slip, or with negative `sense` without slip."""
    intervals = [Interval(0, 29, State.STICK), Interval(30, count - 1, State.SLIP)]
    slips = np.arange(count) >= 30
    rng = np.random.default_rng(seed)
    loud = np.where(slips == (sense > 0), 1e-2, 1e-4)[:, None]
    signals = (loud * rng.lognormal(0, 0.3, (count, len(SIGNALS)))).astype(np.float32)
    signals[0] = np.nan
    outputs = Outputs(name, count, 63, np.ones(count), np.zeros(count, bool), signals)
    return LabelledRecording(thing, intervals, outputs)


def test_a_model_is_asked_about_the_objects_that_it_has_not_seen():
    # One object is the other way round. Who had seen it would know; who has not is wrong about it.
    things = [made_up(f"{thing}{k}", thing, k, -1.0 if thing == "c" else 1.0) for k, thing in enumerate("aaaabbbbc")]
    scores = refitted(things, lambda own: own.object)
    assert [len(score) for score in scores] == [60] * 9
    assert all(np.isnan(score[0]) and np.isfinite(score[1:]).all() for score in scores)
    right = [np.mean((score[1:] > 0.5) == (np.arange(1, 60) >= 30)) for score in scores]
    assert min(right[:8]) > 0.8
    assert right[8] < 0.2


def test_without_both_labels_on_other_objects_there_is_no_model():
    assert refitted([made_up("a0", "a", 0), made_up("a1", "a", 1)], lambda own: own.object) is None
    sticks = made_up("b0", "b", 2)
    only = LabelledRecording("b", [Interval(0, 59, State.STICK)], sticks.outputs)
    assert refitted([made_up("a0", "a", 0), only], lambda own: own.object) is None


def test_simulated_frames_teach_where_real_ones_do_not_and_alone():
    things = [made_up(f"a{k}", "a", k) for k in range(2)]
    assert refitted(things, lambda own: own.object) is None, "there is no other object"
    simulated = as_dataset([made_up(f"s{k}", "s", 10 + k) for k in range(4)])
    for scores in (
        zero_shot(things, simulated),
        refitted([*things, made_up("b0", "b", 5)], lambda o: o.object, simulated),
    ):
        right = [np.mean((score[3:] > 0.5) == (np.arange(3, 60) >= 30)) for score in scores[:2]]
        assert min(right) > 0.9


def test_only_training_objects_are_learnt_from_and_one_in_so_many():
    data = as_dataset([made_up(f"{thing}{k}", thing, k) for thing in ("can", "book") for k in range(6)])
    for every, count in ((1, 6), (3, 2)):
        part = training_part(data, every)
        assert set(part["object"].tolist()) == {"can"}
        assert len(set(part["recording"].tolist())) == count
    with pytest.raises(DataError, match="has none of the training objects"):
        training_part(data.where(data["object"] == "book"), 1)


def test_detections_are_counted_as_by_hand(outputs):
    own = outputs[SLIDE]
    labelled = LabelledOutputs(truth()[SLIDE], own.slip["imprint"], own.moved_px, own.slid["imprint"], own.moved_px)
    counts = counted(labelled)
    assert (counts.found, counts.slip, counts.noticed, counts.intervals) == (LAST - FIRST + 1,) * 2 + (1, 1)
    assert (counts.moving, counts.false_moving) == (0, 0)
    assert counts.still == COUNT - LAST - 2
    assert math.isnan(counts.per_100_moving)
