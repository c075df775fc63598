"""Pipeline from image to observation: track -> field -> contact -> features.

The same object processes the running cell and recordings, frame by frame, so offline and online results are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Literal

from lsds.contracts import Observation
from lsds.safety.validation import validated_tracks
from lsds.tactile.compiled import use_compiled
from lsds.tactile.contact_load import load_of, normal_force_of
from lsds.tactile.depth import DepthEstimator
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder
from lsds.tactile.gate import check_image
from lsds.tactile.imprint.motion import FollowedImprint, ImprintFollower, Step
from lsds.tactile.lost_markers import fill_lost
from lsds.tactile.reference import average_frames
from lsds.tactile.slip_residual import EvidenceBasis, SlipEvidence
from lsds.tactile.views import Viewer
from lsds.tactile.working_image import WorkingImage

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts import (
        ContactPatch,
        DeformationField,
        Frame,
        MarkerReference,
        MarkerTracks,
        SensorSpec,
        Tracker,
    )
    from lsds.tactile.options import TactileOptions


Extent = Literal["in full", "at rest", "markers"]
"""How much of a frame is computed: everything; everything, although nothing moves; only the markers."""


class Perception:
    """Computes observations; keeps the state of tracker, field and features between frames.

    `metres_per_px` and all positions in px refer to the working image (`lsds.tactile.working_image`).
    """

    def __init__(
        self,
        tracker: Tracker,
        spec: SensorSpec,
        options: TactileOptions,
        *,
        tracker_name: str = "tracker",
        imprint_step: Step | None = None,
        extent_of: Callable[[DeformationField, float], Extent] | None = None,
    ) -> None:
        """`tracker_name` names the tracker in errors. `imprint_step` runs the computation of the imprint's motion.

        The motion is computed at most once per frame, when a detector or estimator first asks for it. `extent_of`
        decides by the field, and the share of markers lost in this frame, how much of it is computed. Of a frame of
        which only the markers are followed, the last contact patch stands, and the imprint's motion is computed only
        if something moves in the next frame that is seen in full.
        """
        self._extent_of = extent_of
        self._imprint_step = imprint_step
        self._tracker, self._tracker_name = tracker, tracker_name
        self._spec = spec
        self._options = options
        self._shear_n_m3 = options.shear_kpa_mm * 1e6
        self._metres_per_camera_px = spec.metres_per_px if options.mm_per_px is None else options.mm_per_px * 1e-3
        self._pad_m2 = spec.width_px * spec.height_px * self._metres_per_camera_px**2
        self.metres_per_px = self._metres_per_camera_px
        self._viewer = Viewer()
        self._features = FeatureExtractor()
        self.reference: MarkerReference | None = None
        self.reference_frame: Frame | None = None

    def start(self, frames: Sequence[Frame]) -> MarkerReference:
        """Build the reference from one or more frames of the untouched gel. Raises DataError if they are unusable.

        Raises MissingExtra if compiled functions are asked for and numba is not installed.
        """
        for frame in frames:
            check_image(frame, self._spec)
        reference = average_frames(frames)
        self._working = WorkingImage(reference)
        self.metres_per_px = self._metres_per_camera_px * self._working.scale
        self.reference_frame = self._working.frame(reference)
        self.reference = self._tracker.start(self.reference_frame, self._spec.pad)
        self._field = FieldBuilder(self.reference, self.metres_per_px)
        compiled = use_compiled(self._options.arithmetic)
        self._depth = DepthEstimator(
            self.reference_frame,
            self.metres_per_px,
            scale=self._options.depth_scale,
            threshold_m=self._options.contact_threshold_mm * 1e-3,
            compiled=compiled,
        )
        self._features.start(self.reference, self._field.position_m)
        self._imprint = ImprintFollower(
            self.metres_per_px, self.reference, self.reference_frame, self._imprint_step, compiled=compiled
        )
        self._basis = EvidenceBasis(self.reference)
        self._followed: NDArray[np.bool_] | None = None
        self._contact: ContactPatch | None = None
        self._left_out: list[FollowedImprint] = []
        return self.reference

    def reset(self) -> None:
        """Forget the motion; keep the reference."""
        self._tracker.reset()
        self._field.reset()
        self._features.reset()
        self._imprint.reset()
        self._followed = self._contact = None
        self._left_out = []

    def observe(self, frame: Frame) -> tuple[Observation, MarkerTracks]:
        """Return the observation of the next frame, and its tracks. Raises DataError for an unusable frame."""
        check_image(frame, self._spec)
        frame = self._viewer.view(self._working.frame(frame))
        count = len(self._field.position_m)
        tracks = validated_tracks(self._tracker_name, self._tracker.update(frame), count, frame.seq)
        field = self._field.build(tracks)
        lost = 0.0 if self._followed is None else float((self._followed & ~tracks.valid).mean())
        self._followed = tracks.valid
        extent: Extent = "in full"
        if self._contact is not None and self._extent_of is not None:
            extent = self._extent_of(field, lost)
        if extent == "at rest":
            for left_out in self._left_out:
                left_out.skip()
        if self._contact is None or extent != "markers":
            self._contact = self._depth.measure(frame)
        contact = self._contact
        filled = None if field.valid.all() else fill_lost(field)
        features = self._features.extract(field, contact, filled)
        evidence = SlipEvidence(field, contact, self._basis)
        imprint = self._imprint.follow(frame, field)
        self._left_out = [*self._left_out, imprint] if extent == "markers" else []
        normal = normal_force_of(contact, self._pad_m2)
        load = load_of(field, self.metres_per_px, self._shear_n_m3, normal, filled)
        shown = Observation(
            frame.t_ns, frame.seq, field.dt_s, field, contact, features, frame, evidence, imprint, load, lost
        )
        return shown, tracks
