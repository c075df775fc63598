"""Computing time of a finger's frame (mechanics and image), and the difference of each optical tier from the full
one."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import cv2
import numpy as np
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.look import look_of
from lsds_mocks.gel.auto.gel import AutoGel
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.optics.background import background
from lsds_mocks.optics.renderer import Renderer
from lsds_mocks.optics.shading import Shader, Tier

from lsds.clock import perf_ns
from lsds.contracts.study import StudyResult, Value
from lsds_research.studies.gel.scenes import Scene, named_scenes
from lsds_research.studies.optics.plot import draw

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel
    from numpy.typing import NDArray

    from lsds.contracts import BuildContext
    from lsds_research.studies.optics.options import OpticsOptions

TIERS: tuple[Tier, ...] = ("markers", "linear", "full")
FRAME_MS = 40.0
"""Time between two frames, ms: a camera at 25 Hz."""
COLUMNS = (
    ("scene", "scene", ""),
    ("tier", "optics", ""),
    ("rms_levels", "RMS levels", ".2f"),
    ("l1_levels", "L1 in contact", ".2f"),
    ("psnr_db", "PSNR dB", ".1f"),
    ("image_us", "us image", ".0f"),
    ("mechanics_us", "us mechanics", ".0f"),
    ("frame_us", "us finger-frame", ".0f"),
    ("frame_p99_us", "p99", ".0f"),
    ("real_time", "x real time, 2 fingers", ".0f"),
)


class OpticsStudy:
    """A `Study`."""

    def __init__(self, options: OpticsOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run a gel through each scene and render each frame by each tier. Raises DataError for an unknown scene."""
        scenes = named_scenes(self.options.scenes).values()
        rows: list[dict[str, Value]] = []
        for done, scene in enumerate(scenes, 1):
            rows += self._measure(scene)
            tick(done, len(scenes))
        notes = [
            "errors are against full normals at every pixel; two fingers: mechanics and image of both, "
            f"frames of {FRAME_MS:g} ms; gel: {self.options.fidelity}",
        ]
        title = "A finger's frame, simulated: colours' error, and time of mechanics and image, one thread"
        return StudyResult(title, COLUMNS, rows, partial(draw, rows=rows), notes)

    def _gel(self, scene: Scene) -> GelModel:
        if self.options.fidelity == "pad":
            return FieldGel(scene.shape, scene.material, follows=scene.follows)
        tolerance_m = self.options.tolerance_um * 1e-6
        return AutoGel(scene.shape, scene.material, tolerance_m=tolerance_m, follows=scene.follows)

    def _measure(self, scene: Scene) -> list[dict[str, Value]]:
        rows: list[dict[str, Value]] = []
        for tier in TIERS:
            runs = [_frames(self._gel(scene), scene, tier) for _ in range(self.options.repeats + 1)]
            # The first run compiles and fills tables, which must not count as time of a frame.
            times = np.array([(mechanics, image, mechanics + image) for mechanics, image, _ in runs[1:]])
            mechanics, image, whole = times.transpose(1, 0, 2).reshape(3, -1)
            rows.append(
                {"scene": scene.name, "tier": tier}
                | _errors(runs[-1][2], tier)
                | {
                    "image_us": float(np.median(image)),
                    "mechanics_us": float(np.median(mechanics)),
                    "frame_us": float(np.median(whole)),
                    "frame_p99_us": float(np.quantile(whole, 0.99)),
                    "real_time": FRAME_MS * 1e3 / (2 * float(whole.mean())),
                }
            )
        return rows


def _frames(
    gel: GelModel, scene: Scene, tier: Tier
) -> tuple[NDArray[np.float64], NDArray[np.float64], Callable[..., NDArray[np.float32]]]:
    """Return times (frames,) in microseconds of mechanics and of the image, and the surface at the end."""
    renderer = Renderer(look_of(GelSightOptions(optics=tier)), [0])
    for step in range(1, scene.presses + 1):
        gel.press(step / scene.presses * scene.indentation_m)
        gel.set_friction(np.full(gel.points_m.shape[1], scene.friction))
        gel.trial(0.0, 0.0)
        gel.commit()
    renderer.render(gel, gel.state(), renderer.markers(gel, gel.state()), 0.0, 9)
    times = []
    for seq, motion in enumerate(scene.frames, 10):
        begun = perf_ns()
        gel.set_friction(np.full(gel.points_m.shape[1], scene.friction))
        gel.trial(*motion)
        gel.commit()
        solved = perf_ns()
        state = gel.state()
        renderer.render(gel, state, renderer.markers(gel, state), seq / 25, seq)
        times.append((solved - begun, perf_ns() - solved))
    mechanics, image = np.array(times).T / 1e3
    last = gel.state()
    return mechanics, image, lambda x, y: gel.depth(last, x, y)


def _errors(depth: Callable[..., NDArray[np.float32]], tier: Tier) -> dict[str, Value]:
    """Return differences from full normals at every pixel, on a gel without dots or noise."""
    light = background(0.0, np.random.default_rng(0))
    metres = GelSightOptions().mm_per_px * 1e-3
    best, tried = Shader(light, metres, "full", reduction=1), Shader(light, metres, tier)
    off = tried.shade(None, depth, True).astype(float) - best.shade(None, depth, True)
    contact = cv2.dilate((depth(best.x_m, best.y_m) > 20e-6).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    return {
        "rms_levels": float(np.sqrt((off**2).mean())),
        "l1_levels": float(np.abs(off[contact]).mean()),
        "psnr_db": float(10 * np.log10(255**2 / max((off**2).mean(), 1e-6))),
    }
