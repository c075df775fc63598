"""Options of the simulated cell: the object, its friction, the gel pads and the fingers that carry them."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, Self, cast

from pydantic import BaseModel, ConfigDict, Field, model_validator

from lsds_mocks.objects.catalogue import CATALOGUE, ObjectName, ShapeName, TextureName

_PROPORTIONS = (1.0, 10.0)
"""Range of a pad's width and height over its thickness: higher pads are posts, and the matrices of flatter ones exceed
the memory of a common computer."""


class ContactOptions(BaseModel):
    """Options of an object between two pads: its shape and friction, the gel, and the fingers.

    Lengths are in millimetres here for convenience; SI units inside.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    step_ms: float = Field(default=2.0, ge=0.25, le=10, description="time step of the physics, on an absolute grid")
    fidelity: Literal["auto", "winkler", "layer", "pad"] = Field(
        default="auto",
        description="gel model: auto (elastic pad, automatic grid), winkler (bristles), elastic layer or pad",
    )
    tolerance_um: float = Field(
        default=20.0, ge=0.5, le=200, description="RMS error of marker motion allowed by the grid of auto"
    )
    grid: Literal[1, 2, 4] = Field(
        default=2,
        description="gel cells per 0.96 mm in each direction, for layer and pad (1: 0.96 mm, 2: 0.48 mm, 4: 0.24 mm)",
    )

    object: ObjectName = Field(
        default="pvc-pipe", description="object of the catalogue; other options set here override its values"
    )
    shape: ShapeName = Field(default="cylinder", description="shape of the surface in contact with the pads")
    diameter_mm: float = Field(default=25.0, ge=4, le=45, description="thickness of the object between the pads")
    width_mm: float = Field(default=60.0, ge=1, le=1000, description="width of a box's face")
    edge_mm: float = Field(default=1.0, ge=0.1, le=50, description="radius of an edge, or of a box's rounded edges")
    turned_deg: float = Field(default=0.0, ge=-90, le=90, description="angle between object and pad")
    texture: TextureName = Field(default="smooth", description="relief of the surface (winkler uses the outline only)")
    texture_size_mm: float = Field(default=1.0, ge=0.3, le=24, description="size of pores, bumps or threads")
    texture_depth_mm: float = Field(default=0.0, ge=0, le=5, description="depth of the relief")
    grain_um: float = Field(
        default=5.0,
        ge=0,
        le=50,
        description="RMS height of the surface's fine relief, which the gel shows; 0, or a height map: none",
    )
    grain_mm: float = Field(default=0.4, ge=0.15, le=3, description="size of its features")
    height_map: str = Field(
        default="", description="file of a height map that replaces shape and texture: .npy (m) or image"
    )
    height_map_mm_per_px: float = Field(default=0.1, gt=0, le=10, description="spacing of the height map's samples")
    height_map_range_mm: float = Field(default=1.0, gt=0, le=50, description="height of white in a height map image")
    length_mm: float = Field(default=150.0, ge=20, le=1000, description="length of the upright object")
    mass_kg: float = Field(default=0.3, gt=0, le=5, description="mass of the object with its contents")
    stiffness_n_mm: float = Field(
        default=1000.0, gt=0, le=1e5, description="normal stiffness of one side of the object"
    )
    grip_height_mm: float = Field(
        default=50.0, ge=0, le=1000, description="height of the pad centre above the table at the start"
    )

    static_friction: float = Field(default=0.55, ge=0.02, le=3, description="static friction coefficient")
    kinetic_friction: float = Field(
        default=0.45, ge=0.01, le=3, description="kinetic friction coefficient at high speed"
    )
    friction_scale: float = Field(
        default=1.0,
        ge=0.2,
        le=5,
        description="factor of both friction coefficients, for the same object on another day",
    )
    stribeck_speed_mm_s: float = Field(
        default=10.0, gt=0, le=1000, description="speed scale of the transition from static to kinetic friction"
    )
    texture_amplitude: float = Field(
        default=0.08, ge=0, le=0.3, description="relative standard deviation of friction over the object's surface"
    )
    chatter_amplitude: float = Field(
        default=0.25,
        ge=0,
        le=0.6,
        description="relative standard deviation of the whole patch's kinetic friction along the slide",
    )

    poisson: float = Field(default=0.48, ge=0.3, le=0.499, description="Poisson's ratio of the gel (layer and pad)")
    modulus_mpa: float = Field(default=0.2, ge=0.02, le=5, description="Young's modulus of the gel")
    pad_width_mm: float = Field(default=24.96, gt=1, le=200, description="size of the gel along x")
    pad_height_mm: float = Field(default=20.16, gt=1, le=200, description="size of the gel along y")
    pad_thickness_mm: float = Field(default=4.0, gt=0.2, le=50, description="thickness of the gel")
    pad_correction: str = Field(
        default="", description="file for pads of other proportions: python -m lsds_research.pad.make_pad makes it"
    )
    finger_stiffness_n_mm: float = Field(
        default=5.0, gt=0, le=1000, description="normal stiffness of one finger with its gel holder, without the gel"
    )
    vibration_um: float = Field(default=3.0, ge=0, le=200, description="maximum displacement of the arm's vibration")
    drop_slip_mm: float = Field(default=60.0, gt=0, le=1000, description="slip distance that counts as dropped")
    history_s: float = Field(default=0.0, ge=0, le=3600, description="duration of per-step truth to keep")

    @property
    def residual(self) -> float:
        """Relative residual of a settled gel. It acts like an external force, which backward Euler damps."""
        return 0.02

    @model_validator(mode="before")
    @classmethod
    def _take_object(cls, data: Any) -> Any:
        """Fill in the catalogue's values of the object for options that are not set."""
        name = data.get("object", "") if isinstance(data, dict) else None
        spec = CATALOGUE.get(cast(ObjectName, name)) if isinstance(name, str) else None
        if spec is None:
            return data
        known = dataclasses.asdict(spec) | data
        length = known["length_mm"]
        if "grip_height_mm" not in data and isinstance(length, int | float):
            known["grip_height_mm"] = min(cls.model_fields["grip_height_mm"].default, length / 2)
        return known

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.kinetic_friction > self.static_friction:
            raise ValueError("kinetic_friction must not exceed static_friction")
        if self.shape == "box" and not self.height_map and 2 * self.edge_mm > self.width_mm:
            raise ValueError("edge_mm must not exceed half of width_mm: rounded by more, the box would have no face")
        for name in ("pad_width_mm", "pad_height_mm"):
            if not _PROPORTIONS[0] <= getattr(self, name) / self.pad_thickness_mm <= _PROPORTIONS[1]:
                raise ValueError(f"{name} must be {_PROPORTIONS[0]:g} to {_PROPORTIONS[1]:g} times pad_thickness_mm")
        if self.grip_height_mm > self.length_mm:
            raise ValueError("grip_height_mm must not exceed length_mm: the pads would close above the object")
        return self


class CellOptions(ContactOptions):
    """Options of `[cell.simulated]`. The default: a weighted PVC pipe standing on a table, gripped at its foot."""

    integrator: Literal["backward-euler", "midpoint"] = Field(
        default="backward-euler", description="time integration; midpoint keeps oscillations that backward Euler damps"
    )
    centre_x_mm: float = Field(
        default=0.0,
        ge=-100,
        le=100,
        description="distance of the centre of mass to the right of the pads; if not 0, the object can rotate",
    )
    clamped: bool = Field(default=False, description="clamp the object to the table: it can neither lift nor rotate")
    changes_after_s: float = Field(
        default=1.0, ge=0, le=600, description="when pouring, shove and wet patch begin, after the object was lifted"
    )
    pour_to: float = Field(default=1.0, ge=0.1, le=10, description="factor to which pouring changes the mass; 1: none")
    pour_s: float = Field(default=3.0, gt=0, le=600, description="duration of pouring")
    shove_n: float = Field(default=0.0, ge=0, le=200, description="peak of a downward shove, N; 0: none")
    shove_s: float = Field(default=0.2, gt=0, le=10, description="duration of the shove")
    wet_to: float = Field(default=1.0, ge=0.1, le=2, description="factor of friction where it gets wet; 1: it does not")

    @property
    def residual(self) -> float:
        """Relative residual of a settled gel. The midpoint rule lets it oscillate, so it is less there."""
        return super().residual if self.integrator == "backward-euler" else 0.004
