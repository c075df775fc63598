"""The report of the gel with automatic grid: chosen grids, reasons, cost, and limits of accuracy."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

STRAIN_DOUBTFUL = 0.1
"""Indentation over thickness above which the small-strain model is off by some micrometres."""
STRAIN_INVALID = 0.2
"""Indentation over thickness above which the small-strain model is not valid."""
_AT_WALL_M = 1e-9
"""Distance from a wall up to which the contact reaches it, m; covers rounding errors only."""


def invalid_reasons(strain: float) -> list[str]:
    """Return why results of a small-strain model at an indentation over thickness are not valid; empty if they are."""
    if strain <= STRAIN_INVALID:
        return []
    return [
        f"indentation is {strain:.0%} of the thickness: small strain is not valid beyond {100 * STRAIN_INVALID:g} %"
    ]


def strain_warnings(strain: float) -> list[str]:
    """Return the warnings of any small-strain model at an indentation over thickness."""
    if invalid := invalid_reasons(strain):
        return invalid
    if strain > STRAIN_DOUBTFUL:
        return [f"indentation is {strain:.0%} of the thickness: small strain is off by some um beyond 10 %"]
    return []


@dataclass(frozen=True, slots=True)
class Choice:
    """A change of grid: the object's travel by then (m), the cell's side (m), and the error estimate behind it (m)."""

    at_m: float
    pitch_m: float
    estimate_m: float | None
    why: str


@dataclass(frozen=True, slots=True)
class FidelityReport:
    """Report of a gel with automatic grid.

    `estimate_m` is the last audit's estimate of the markers' RMS error due to the grid; `error_m` is its RMS over the
    object's travel. Both are None before the first audit. `strain` is the greatest indentation over the thickness. Work
    is counted in multiplications of the sweeps; `audit_share` is the auditor's part of it. `gave_up` is set if meeting
    the tolerance needs a finer grid than exists or can keep up.
    """

    tolerance_m: float
    pitch_m: float
    estimate_m: float | None
    error_m: float | None
    audits: int
    choices: tuple[Choice, ...]
    work: float
    audit_share: float
    strain: float
    wall_distance_m: float | None
    unconverged: int
    gave_up: bool = False

    @property
    def summary(self) -> str:
        """Return one line with the grid, its error and the tolerance."""
        of = f"{self.tolerance_m * 1e6:g} um allowed"
        if self.error_m is None:
            error = f"no audit was called for, {of}"
        else:
            error = f"error {self.error_m * 1e6:.1f} um over the way by {self.audits} audits, {of}"
        return f"cells of {self.pitch_m * 1e3:.2f} mm, {error} (simulated)"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return warnings: errors that audits cannot detect, or have found and cannot correct."""
        found = strain_warnings(self.strain)
        if self.gave_up and self.estimate_m is not None and self.estimate_m > self.tolerance_m:
            found.append("the finest grid that can keep up does not meet the tolerance")
        elif self.error_m is not None and self.error_m > self.tolerance_m:
            found.append(f"the dots' error over the way, {self.error_m * 1e6:.1f} um, exceeds the tolerance")
        if self.wall_distance_m is not None and self.wall_distance_m <= _AT_WALL_M:
            found.append("the contact reaches a wall of the pad, the shape of whose edge is not modelled")
        if self.unconverged:
            found.append(f"{self.unconverged} solutions were stopped before they had settled")
        return tuple(found)

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {**asdict(self), "warnings": list(self.warnings), "invalid": invalid_reasons(self.strain)}
