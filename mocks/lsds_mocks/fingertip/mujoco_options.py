"""Options of the cell in a MuJoCo scene."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from lsds_mocks.cell.options import CellOptions

_NOT_IN_MUJOCO = ("clamped", "centre_x_mm", "pour_to", "shove_n", "wet_to", "integrator")
"""Options of the cell `simulated` that a MuJoCo scene does not have."""


class MujocoCellOptions(CellOptions):
    """Options of `[cell.mujoco]`: object, friction and gel as in `[cell.simulated]`, and the scene that holds them.

    Without `scene`, a pipe stands between two pads, as the object's options describe it. A scene of your own needs two
    frames on the pads and one on the object (sites or bodies), an actuator that sets the height of the pads above
    their start (m), and one that sets the way (m) by which each finger closes from its start.
    """

    scene: str = Field(default="", description="MJCF file of a scene; default: two pads and the object on a table")
    left_pad: str = Field(default="left_pad", description="site or body of the left pad, whose image is seen")
    right_pad: str = Field(default="right_pad", description="site or body of the right pad")
    held: str = Field(default="held", description="site or body of the object")
    lift: str = Field(default="lift", description="actuator of the pads' height")
    squeeze: str = Field(default="squeeze", description="actuator of the fingers' closing")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        for name in _NOT_IN_MUJOCO:
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ValueError(f"{name} is an option of the cell 'simulated'; a MuJoCo scene does not have it")
        return self
