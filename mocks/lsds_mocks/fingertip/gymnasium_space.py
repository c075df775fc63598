"""Observation of a fingertip for a Gymnasium environment: a space, and values that lie in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.support.extras import require
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from lsds_mocks.fingertip.fingertip import SimulatedFingertip


def observation_space(tip: SimulatedFingertip) -> Any:
    """Return the `gymnasium.spaces.Dict` of `observation`.

    `image` uint8 (240, 320, 3) RGB; `markers` float32 (n, 2), displacement from the undeformed gel in pixels; `force`
    float32 (3,), load of the object on the gel in the pad's frame, N. Raises MissingExtra without gymnasium.
    """
    require("gymnasium", extra="gymnasium", purpose="an observation space")
    from gymnasium import spaces

    return spaces.Dict(
        {
            "image": spaces.Box(0, 255, (HEIGHT_PX, WIDTH_PX, 3), np.uint8),
            "markers": spaces.Box(-np.inf, np.inf, tip.rest_markers.shape, np.float32),
            "force": spaces.Box(-np.inf, np.inf, (3,), np.float32),
        }
    )


def observation(tip: SimulatedFingertip) -> dict[str, Any]:
    """Return what a fingertip observes now; it needs no gymnasium."""
    truth = tip.truth()
    return {
        "image": tip.image(),
        "markers": (tip.markers() - tip.rest_markers).astype(np.float32),
        "force": np.array([*truth.force_n, -truth.normal_force_n], np.float32),
    }
