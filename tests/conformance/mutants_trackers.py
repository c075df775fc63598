"""Trackers with one mistake each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from catching import caught
from honest import HonestTracker

from lsds.contracts import MarkerReference
from lsds.errors import DataError
from lsds.testing import algorithms as every
from lsds.testing import tracks


class OtherReference(HonestTracker):
    """Describes the grid wrongly, and follows it well."""

    def start(self, frame, pad=None):
        return replace(super().start(frame, pad), **self.described(self.reference))


@caught("tracker", tracks.check_reference_is_a_grid, "cell is .row, column.")
class ColumnBeforeRow(OtherReference):
    def described(self, reference):
        return {"cell": reference.cell[:, ::-1], "shape": reference.shape[::-1]}


@caught("tracker", tracks.check_reference_is_a_grid, r"both are \(rows, columns\)")
class ShapeIsColumnsRows(OtherReference):
    def described(self, reference):
        return {"shape": reference.shape[::-1]}


@caught("tracker", tracks.check_reference_is_a_grid, "pitch_px .along columns, along rows.")
class TwiceThePitch(OtherReference):
    def described(self, reference):
        return {"pitch_px": (reference.pitch_px[0], 2 * reference.pitch_px[1])}


@caught("tracker", tracks.check_reference_is_a_grid, "px from the place of its cell")
class AxesPointBack(OtherReference):
    def described(self, reference):
        return {"axes": -reference.axes}


@caught("tracker", tracks.check_reference_is_a_grid, "image_size is .240, 320.; it is .width, height.")
class ImageSizeIsHeightWidth(OtherReference):
    def described(self, reference):
        return {"image_size": reference.image_size[::-1]}


@caught("tracker", tracks.check_follows_a_shifted_grid, "keep the order of the reference")
class SwapsTwoMarkers(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        order = np.arange(len(found.valid))
        order[[4, 5]] = 5, 4
        return replace(found, xy_px=found.xy_px[order], valid=found.valid[order], flags=found.flags[order])


@caught("tracker", tracks.check_tracks_are_sound, "one row for each marker")
class DropsLostMarkers(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        kept = found.valid & (np.arange(len(found.valid)) > 0)
        return replace(found, xy_px=found.xy_px[kept], valid=found.valid[kept], flags=found.flags[kept])


@caught("tracker", tracks.check_follows_a_shifted_grid, "answer for this frame")
class IsOneFrameLate(HonestTracker):
    def reset(self):
        super().reset()
        self.before = None

    def update(self, frame):
        found = super().update(frame)
        before, self.before = self.before, found
        return found if before is None else replace(before, t_ns=frame.t_ns, seq=frame.seq)


@caught("tracker", tracks.check_flags_what_is_lost, "flag them as LOST")
class NeverFlags(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        every_one = np.ones(len(found.valid), bool)
        return replace(found, xy_px=self.last.copy(), valid=every_one, flags=np.zeros(len(every_one), np.uint8))


@caught("tracker", tracks.check_tracks_are_sound, "must be NaN")
class KeepsThePositionOfTheLost(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        return replace(found, xy_px=self.last.copy())


@caught("tracker", tracks.check_tracks_are_sound, "only OK is valid")
class FlagsNothingThatItCallsInvalid(HonestTracker):
    def update(self, frame):
        return replace(super().update(frame), flags=np.zeros(63, np.uint8))


@caught("tracker", tracks.check_tracks_are_sound, "OUT_OF_VIEW")
class LeavesTheImage(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        return replace(found, xy_px=found.xy_px + np.array([0.0, 200.0]))


@caught("tracker", tracks.check_tracks_are_sound, "copy t_ns and seq")
class CountsItsOwnFrames(HonestTracker):
    def update(self, frame):
        return replace(super().update(frame), seq=7)


@caught("tracker", tracks.check_never_raises_on_an_image, "raised DataError on a black image")
class RaisesOnBlack(HonestTracker):
    def update(self, frame):
        if not frame.image.any():
            raise DataError("black")
        return super().update(frame)


@caught("tracker", tracks.check_refuses_a_reference_without_markers, "found 63 markers in a black frame")
class TakesABlackReference(HonestTracker):
    def start(self, frame, pad=None):
        if frame.image.any():
            return super().start(frame, pad)
        return MarkerReference(np.zeros((63, 2)), np.zeros((63, 2), int), pad, (1.0, 1.0), np.eye(2), (320, 240))


@caught("tracker", every.check_answers_do_not_change_later, "changed after it was returned")
class ReusesItsArrays(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        self.room = getattr(self, "room", found.xy_px)
        self.room[:] = found.xy_px
        return replace(found, xy_px=self.room)


@caught("tracker", every.check_reset_equals_a_new_build, "after reset")
class KeepsItsMotionOverReset(HonestTracker):
    """Its answer is smoothed, and the smoothed motion outlives a reset."""

    def start(self, frame, pad=None):
        self.smooth = None
        return super().start(frame, pad)

    def update(self, frame):
        found = super().update(frame)
        smooth = found.xy_px if self.smooth is None else 0.5 * self.smooth + 0.5 * found.xy_px
        self.smooth = smooth
        return replace(found, xy_px=smooth)


@caught("tracker", every.check_leaves_its_inputs, "it modified .image")
class DrawsIntoTheImage(HonestTracker):
    def update(self, frame):
        found = super().update(frame)
        if frame.image.flags.writeable:
            frame.image[:5] = 0
        return found


@caught("tracker", every.check_leaves_global_state, "numpy's global random state")
class SeedsAtTheStart(HonestTracker):
    def start(self, frame, pad=None):
        np.random.seed(0)  # noqa: NPY002
        return super().start(frame, pad)
