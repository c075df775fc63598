"""The configuration of a robot."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from pathlib import Path

from lerobot.choices import ChoiceRegistry


@dataclass(kw_only=True)
class RobotConfig(ChoiceRegistry, abc.ABC):
    """Name of one of several robots, and the folder of its calibration."""

    id: str | None = None
    calibration_dir: Path | None = None

    @property
    def type(self) -> str:
        """The registered name."""
        return self.get_choice_name(type(self))
