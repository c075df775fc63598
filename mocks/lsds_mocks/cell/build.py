"""Build a cell from options, and share it among the mocks of a rig."""

from __future__ import annotations

import dataclasses
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.contracts.backend import CELL
from lsds.contracts.plant import join
from lsds.errors import ConfigError, ConfigIssue
from lsds_mocks.cell.cell import P, SimulatedCell
from lsds_mocks.cell.options import CellOptions, ContactOptions
from lsds_mocks.gel.kernel import DEFAULT_KERNEL
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.winkler import WinklerGel
from lsds_mocks.objects.build import build_shape
from lsds_mocks.objects.catalogue import ObjectSpec
from lsds_mocks.objects.height_map import height_map
from lsds_mocks.optics.grain import Grain
from lsds_mocks.plant.changes import Changes
from lsds_mocks.plant.friction import SurfaceFriction
from lsds_mocks.plant.plant import Plant, PlantParameters
from lsds_mocks.plant.texture import Chatter, Texture
from lsds_mocks.plant.vibration import Vibration

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.shapes import Shape

_GRAIN = 0x62A1
"""First part of the seed of an object's grain, which separates it from other random streams; chosen."""


def build_surface(options: ContactOptions, material: GelMaterial) -> Shape:
    """Return the object's surface; its relief depends on the object only, so it is the same in every run."""
    if options.height_map:
        return height_map(
            Path(options.height_map), mm_per_px=options.height_map_mm_per_px, range_mm=options.height_map_range_mm
        )
    figures = {field.name: getattr(options, field.name) for field in dataclasses.fields(ObjectSpec)}
    return build_shape(
        ObjectSpec(**figures), material.height_m, np.random.default_rng(zlib.crc32(options.object.encode()))
    )


def build_grain(options: ContactOptions) -> Grain | None:
    """Return the fine relief of the object's surface, the same in every run; None without one.

    A height map already contains the whole surface, so it has no additional relief.
    """
    if not options.grain_um or options.height_map:
        return None
    rng = np.random.default_rng([_GRAIN, zlib.crc32(options.object.encode())])
    return Grain(options.grain_um, options.grain_mm, rng)


def build_gel(options: ContactOptions, shape: Shape, material: GelMaterial) -> GelModel:
    """Return the gel model of the configured tier."""
    if options.fidelity == "winkler":
        kernel = DEFAULT_KERNEL.scaled(GelMaterial().modulus_pa / material.modulus_pa)
        return WinklerGel(shape, material, kernel=kernel)
    # Import the compiled solver and its tables only if they are used.
    from lsds_mocks.gel.field.compiling import prepare

    if options.fidelity == "auto":
        prepare(material, (1, 2))
        from lsds_mocks.gel.auto.gel import AutoGel

        return AutoGel(shape, material, tolerance_m=options.tolerance_um * 1e-6, settled=options.residual)
    prepare(material, (options.grid,), options.fidelity)
    from lsds_mocks.gel.field.gel import FieldGel

    return FieldGel(shape, material, fine=options.grid, kernel=options.fidelity, tolerance=options.residual)


def build_material(options: ContactOptions) -> GelMaterial:
    """Return the gel's size and elasticity."""
    return GelMaterial(
        modulus_pa=options.modulus_mpa * 1e6,
        poisson=options.poisson,
        thickness_m=options.pad_thickness_mm * 1e-3,
        width_m=options.pad_width_mm * 1e-3,
        height_m=options.pad_height_mm * 1e-3,
        correction=options.pad_correction or None,
    )


def build_friction(
    options: ContactOptions, texture_rng: np.random.Generator, chatter_rng: np.random.Generator
) -> SurfaceFriction:
    """Return the friction of the object's surface, drawn from two streams."""
    length = options.length_mm * 1e-3
    return SurfaceFriction(
        Texture(length, options.texture_amplitude, texture_rng),
        static=options.static_friction * options.friction_scale,
        kinetic=options.kinetic_friction * options.friction_scale,
        stribeck_m_s=options.stribeck_speed_mm_s * 1e-3,
        chatter=Chatter(length, chatter_rng),
        chatter_amplitude=options.chatter_amplitude,
    )


def plant_streams(seed: list[int]) -> list[np.random.Generator]:
    """Return the random streams of the surface's friction, of its chatter, and of the arm's vibration."""
    return np.random.default_rng(seed).spawn(3)


def build_plant(options: CellOptions, seed: list[int]) -> Plant:
    """Return the plant; `seed` draws the object's surface and the arm's vibration."""
    material = build_material(options)
    gel = build_gel(options, build_surface(options, material), material)
    gel.grain = build_grain(options)
    length = options.length_mm * 1e-3
    texture_rng, chatter_rng, shake_rng = plant_streams(seed)
    friction = build_friction(options, texture_rng, chatter_rng)
    parameters = PlantParameters(
        diameter_m=options.diameter_mm * 1e-3,
        width_m=(options.width_mm if options.shape == "box" else options.diameter_mm) * 1e-3,
        length_m=length,
        mass_kg=options.mass_kg,
        grip_height_m=options.grip_height_mm * 1e-3,
        finger_n_m=1e3 / (1 / options.finger_stiffness_n_mm + 1 / options.stiffness_n_mm),
        drop_slip_m=options.drop_slip_mm * 1e-3,
        pad_height_m=material.height_m,
        pad_thickness_m=material.thickness_m,
        centre_x_m=options.centre_x_mm * 1e-3,
        clamped=options.clamped,
        theta=1.0 if options.integrator == "backward-euler" else 0.5,
    )
    changes = Changes(
        options.changes_after_s,
        options.pour_to,
        options.pour_s,
        options.shove_n,
        options.shove_s,
        options.wet_to,
    )
    return Plant(parameters, gel, friction, Vibration(options.vibration_um * 1e-6, shake_rng), changes)


def make_cell(options: CellOptions, context: BuildContext) -> SimulatedCell[Plant]:
    """Return a cell that starts at the clock's present."""
    return cell_of(build_plant(options, context.rng_seed("plant")), options, context, options.fidelity)


def cell_of(plant: P, options: ContactOptions, context: BuildContext, model: str) -> SimulatedCell[P]:
    """Return a cell that steps a plant from the clock's present on; `model` names the gel in its report."""
    return SimulatedCell(
        plant,
        step_ns=round(options.step_ms * 1e6),
        start_ns=context.clock.now(),
        history_s=options.history_s,
        model=model,
    )


def build_cell(options: CellOptions, context: BuildContext) -> SimulatedCell[Plant]:
    """Return the cell of the backend `simulated`, installed so that the rig's mocks share it."""
    return context.shared(CELL, lambda: make_cell(options, context))


def shared_cell(context: BuildContext, device: str) -> SimulatedCell[Any]:
    """Return the rig's cell for a camera that renders this package's gel and scene. Raises ConfigError for another."""
    cell = join(context)
    if isinstance(cell, SimulatedCell):
        return cell
    problem = f"{device} renders the cell 'simulated' only, and the rig's is {type(cell).__name__}"
    raise ConfigError("rig", [ConfigIssue("cell.backend", problem, 'write backend = "simulated"')])
