"""The configuration of a camera."""

from __future__ import annotations

import abc
from dataclasses import dataclass

from lerobot.choices import ChoiceRegistry


@dataclass(kw_only=True)
class CameraConfig(ChoiceRegistry, abc.ABC):
    """Size (px) and rate (Hz) of a camera, None if not given."""

    fps: int | None = None
    width: int | None = None
    height: int | None = None

    @property
    def type(self) -> str:
        """The registered name."""
        return self.get_choice_name(type(self))
