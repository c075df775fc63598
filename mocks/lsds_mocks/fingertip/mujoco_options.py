"""Options of the cell in a MuJoCo scene."""

from __future__ import annotations

from pydantic import Field

from lsds_mocks.cell.options import ContactOptions


class MujocoCellOptions(ContactOptions):
    """Options of `[cell.mujoco]`: object, friction and gel as in `[cell.simulated]`, and the scene that holds them.

    Without `scene`, the object of the catalogue stands between two pads. A scene of your own needs two
    frames on the pads and one on the object (sites or bodies), an actuator that sets the height of the pads above
    their start (m), and one that sets the way (m) by which each finger closes from its start.
    """

    scene: str = Field(default="", description="MJCF file of a scene; default: two pads and the object on a table")
    left_pad: str = Field(default="left_pad", description="site or body of the left pad, whose image is seen")
    right_pad: str = Field(default="right_pad", description="site or body of the right pad")
    held: str = Field(default="held", description="site or body of the object")
    lift: str = Field(default="lift", description="actuator of the pads' height")
    squeeze: str = Field(default="squeeze", description="actuator of the fingers' closing")
