"""Stiffness laws of a bonded gel pad, fitted to the finite-pad reference solution.

The reference (pad 24.96 x 20.16 x 4 mm, E = 0.2 MPa, Poisson 0.48, bonded base, free walls, small strain) has four
scenes: a sphere (R 12 mm, 0.4 mm deep: 0.681 N, 1.26 N/mm in shear), a pipe (R 12.5 mm, 0.3 mm: 2.68 N, 3.58 N/mm)
and a flat punch (10 x 10 mm, 0.15 mm: 1.98 N, 3.2 N/mm). Two laws cover them without a constant per scene:

- normal force = c E x volume of geometric overlap, c = 0.57 /mm (sphere and pipe within 6 %, punch -14 %). For a pipe
  that is a power law of exponent 3/2 in the indentation, for a sphere 2, for a punch 1;
- shear stiffness per area = G (1/h + 0.68 x perimeter/area of the contact) (within 5 %): a sheared layer and a rim.

Both scale with the modulus. Not valid above an indentation of a tenth of the thickness, where a real gel stiffens.
"""

from __future__ import annotations

from dataclasses import dataclass

OVERLAP_STIFFNESS_PER_M = 570.0
"""Normal force per volume of overlap and Young's modulus, 1/m; fitted to the reference solution."""
RIM_SHEAR = 0.68
"""Weight of the contact's perimeter over area in the shear stiffness; fitted to the reference solution."""
CONTACT_LEVEL = 0.85
"""Gap at the edge of the contact, as part of the indentation: below 1, since the free surface deforms around it."""
PRESSURE_EXPONENT = 0.55
"""Pressure is proportional to overlap to this power, between half-space (0.5) and thin layer (1); fitted to the onset
of full slip."""


@dataclass(frozen=True, slots=True)
class GelMaterial:
    """A gel pad: Young's modulus (Pa), Poisson's ratio, thickness and size (m), and the file of its finite-pad
    correction (None: the shipped one)."""

    modulus_pa: float = 0.2e6
    poisson: float = 0.48
    thickness_m: float = 4.0e-3
    width_m: float = 24.96e-3
    height_m: float = 20.16e-3
    correction: str | None = None

    @property
    def shear_modulus_pa(self) -> float:
        """E / (2 (1 + v))."""
        return self.modulus_pa / (2 * (1 + self.poisson))

    @property
    def normal_stiffness_n_m3(self) -> float:
        """Normal force per volume of overlap."""
        return OVERLAP_STIFFNESS_PER_M * self.modulus_pa

    def shear_stiffness_n_m3(self, perimeter_per_area_1_m: float) -> float:
        """Shear force per area and deflection under a contact of that perimeter to area ratio."""
        return self.shear_modulus_pa * (1 / self.thickness_m + RIM_SHEAR * perimeter_per_area_1_m)
