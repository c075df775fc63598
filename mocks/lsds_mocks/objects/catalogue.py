"""Objects by name: the pipe of the demonstration, the five unseen objects of the study, and fifteen everyday objects.

The study (LSDS, 2024) names the pipe and the five unseen objects. It pictures its fifteen training objects without
names, so the fifteen here are our choice; they span size, curvature, weight, friction and texture. None was measured:
masses and sizes are those of common specimens, friction against silicone is within the published range of 0.3 to 1.5,
and stiffness is an order of magnitude.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ShapeName = Literal["cylinder", "sphere", "box", "edge"]
TextureName = Literal["smooth", "bumps", "pores", "weave"]
ObjectName = Literal[
    "pvc-pipe",
    "book",
    "scissors",
    "plank",
    "sponge",
    "duster",
    "can",
    "bottle",
    "ball",
    "marble",
    "marker-pen",
    "screwdriver",
    "battery",
    "glue-stick",
    "cardboard-box",
    "tape-roll",
    "ruler",
    "phone",
    "steel-block",
    "candle",
    "wooden-dowel",
]


@dataclass(frozen=True, slots=True)
class ObjectSpec:
    """One object between two fingers.

    Lengths (mm): thickness between the fingers, length along the slide, width of a box, radius of a rounded edge.
    Mechanics: mass (kg), static and kinetic friction with their spread over the surface, normal stiffness of one side
    (N/mm). Surface: texture with size and depth (mm), RMS height (um) and feature size (mm) of the fine relief.
    """

    shape: ShapeName
    diameter_mm: float
    length_mm: float
    mass_kg: float
    static_friction: float
    kinetic_friction: float
    stiffness_n_mm: float = 1000.0
    width_mm: float = 60.0
    edge_mm: float = 1.0
    turned_deg: float = 0.0
    texture: TextureName = "smooth"
    texture_size_mm: float = 1.0
    texture_depth_mm: float = 0.0
    texture_amplitude: float = 0.08
    grain_um: float = 4.0
    grain_mm: float = 0.4


CATALOGUE: dict[ObjectName, ObjectSpec] = {
    # The demonstration.
    "pvc-pipe": ObjectSpec("cylinder", 25, 150, 0.30, 0.55, 0.45, grain_um=5.0),
    # The five unseen objects.
    "book": ObjectSpec(
        "box",
        22,
        200,
        0.35,
        0.75,
        0.65,
        stiffness_n_mm=15,
        width_mm=140,
        texture="weave",
        texture_size_mm=0.8,
        texture_depth_mm=0.03,
    ),
    "scissors": ObjectSpec("edge", 8, 170, 0.09, 0.45, 0.38, edge_mm=1.0, turned_deg=8, grain_um=2.0),
    "plank": ObjectSpec(
        "box",
        18,
        250,
        0.25,
        0.60,
        0.50,
        width_mm=70,
        texture="bumps",
        texture_size_mm=2.0,
        texture_depth_mm=0.01,
        grain_um=8.0,
    ),
    "sponge": ObjectSpec(
        "box",
        40,
        110,
        0.02,
        0.95,
        0.85,
        stiffness_n_mm=0.8,
        width_mm=70,
        texture="pores",
        texture_size_mm=1.6,
        texture_depth_mm=0.8,
        texture_amplitude=0.15,
        grain_um=3.0,
    ),
    "duster": ObjectSpec(
        "box",
        38,
        130,
        0.08,
        0.70,
        0.60,
        stiffness_n_mm=4,
        width_mm=55,
        texture="bumps",
        texture_size_mm=1.5,
        texture_depth_mm=0.25,
        texture_amplitude=0.15,
    ),
    # Fifteen everyday objects.
    "can": ObjectSpec("cylinder", 45, 120, 0.35, 0.50, 0.42, stiffness_n_mm=80, grain_um=3.0),
    "bottle": ObjectSpec("cylinder", 44, 200, 0.40, 0.60, 0.50, stiffness_n_mm=20, grain_um=3.0),
    "ball": ObjectSpec(
        "sphere",
        40,
        40,
        0.06,
        0.80,
        0.70,
        stiffness_n_mm=60,
        texture="bumps",
        texture_size_mm=2.0,
        texture_depth_mm=0.1,
    ),
    "marble": ObjectSpec("sphere", 24, 24, 0.02, 0.40, 0.35, grain_um=1.0),
    "marker-pen": ObjectSpec("cylinder", 18, 140, 0.03, 0.50, 0.42),
    "screwdriver": ObjectSpec(
        "cylinder", 30, 100, 0.12, 0.90, 0.80, texture="bumps", texture_size_mm=3.0, texture_depth_mm=0.2
    ),
    "battery": ObjectSpec("cylinder", 34, 61, 0.14, 0.45, 0.38, grain_um=3.0),
    "glue-stick": ObjectSpec("cylinder", 21, 90, 0.03, 0.55, 0.47, grain_um=3.0),
    "cardboard-box": ObjectSpec(
        "box", 40, 150, 0.20, 0.65, 0.55, stiffness_n_mm=12, width_mm=90, texture_amplitude=0.12, grain_um=8.0
    ),
    "tape-roll": ObjectSpec("cylinder", 45, 50, 0.08, 0.60, 0.52),
    "ruler": ObjectSpec("box", 4, 300, 0.03, 0.50, 0.43, width_mm=30, edge_mm=0.5),
    "phone": ObjectSpec("box", 9, 150, 0.18, 0.65, 0.57, width_mm=72, edge_mm=3.0, grain_um=1.5),
    "steel-block": ObjectSpec("box", 20, 60, 0.45, 0.40, 0.34, width_mm=12, edge_mm=0.5, grain_um=3.0),
    "candle": ObjectSpec("cylinder", 22, 200, 0.07, 0.35, 0.30),
    "wooden-dowel": ObjectSpec(
        "cylinder", 12, 250, 0.04, 0.60, 0.50, texture="bumps", texture_size_mm=1.0, texture_depth_mm=0.02, grain_um=8.0
    ),
}
