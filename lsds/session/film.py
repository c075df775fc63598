"""Film the sensors of a rig: a run in which nothing moves, with a recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from lsds.config import BackendSection, RigConfig
from lsds.config.own import own_section
from lsds.registry.backends import NO_DEVICE
from lsds.session.parts import loaded
from lsds.session.run import run

if TYPE_CHECKING:
    from lsds.session.recording.writer import Images
    from lsds.session.run import Session


def film(
    config: RigConfig | str | Path | None,
    overrides: str | Sequence[str],
    seconds: float,
    out: str | Path,
    *,
    images: Images = "lossless",
    view: str | None = None,
) -> Session:
    """Record the sensors of a rig for a time (s); gripper and arm are left alone. Errors as for `run`."""
    whole = loaded(config, overrides)
    alone = {kind: BackendSection(backend=NO_DEVICE) for kind in ("gripper", "arm", "pose_source")}
    job = own_section("watch", {"duration_s": float(seconds)})
    return run(whole.model_copy(update=alone | {"job": job, "faults": ()}), record=out, images=images, view=view)
