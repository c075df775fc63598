"""Build cameras from their configurations."""

from __future__ import annotations

from typing import Any

from lerobot.cameras.configs import CameraConfig


def make_cameras_from_configs(configs: dict[str, CameraConfig]) -> dict[str, Any]:
    """Return a camera for each configuration, by name; the class is an attribute of the stand-in's configurations."""
    return {name: config.camera_class(config) for name, config in configs.items()}  # type: ignore[attr-defined]
