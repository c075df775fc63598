"""The verdict on a lift: the outcome, its reason, and the exit code of `lsds run`.

`judge` is the only place that decides. `lsds run`, the studies and `lsds study search` use its result.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from lsds.tactile.carried_load import LEAST_EVIDENCE_N

if TYPE_CHECKING:
    from lsds.config import RigConfig
    from lsds.contracts import CellTruth

LOST_SHARE = 0.2
"""Without a truth, the object counts as lost if contact at the end is below this fraction of contact before the
lift."""
LEAST_CONTACT = 0.005
"""A contact area below this fraction of the image at the start of the lift is an empty grip."""
OPENED_BY_CORRECTION_M = 1e-3
"""Fingers count as opened if their aperture grows by more than this since grip was first corrected, m."""
LATE_DETECTION_S = 0.2
"""A slip detected later than this after its onset is a cause of a drop, s. The default cell needs 0.03 to 0.1 s."""
LEAST_FORCE_N = 1e-3
"""Least force to compare a grip with, N: an object without mass needs none."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as a shell expects."""


class Outcome(StrEnum):
    """The outcome of a run. A job that sets it down has `RELEASED` it; one that grips nothing has `ENDED`."""

    HELD = "held"
    SLIPPED = "slipped too far"
    CRUSHED = "crushed"
    DROPPED = "dropped"
    NOT_LIFTED = "not lifted"
    STOPPED = "stopped"
    OUTSIDE = "outside the model's validity"
    RELEASED = "released"
    ENDED = "ended"


EXIT_CODES = {
    Outcome.HELD: 0,
    Outcome.RELEASED: 0,
    Outcome.ENDED: 0,
    Outcome.DROPPED: 8,
    Outcome.SLIPPED: 9,
    Outcome.CRUSHED: 10,
    Outcome.NOT_LIFTED: 11,
    Outcome.OUTSIDE: 12,
}
"""Exit code of each outcome. That of `STOPPED` is the code of the error or the interrupt that stopped the run."""
_IN_GRIP = (Outcome.HELD, Outcome.SLIPPED, Outcome.CRUSHED, Outcome.OUTSIDE)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The outcome of a run with its reason. Figures that need the truth of a simulated cell are None without it.

    `grip_over_needed` compares the grip of a finger with the largest force that the object needed by its weight, the
    arm's acceleration and pushes, a tilt not counted: the steady grip at the end or, if the object is not in the grip
    then, the peak. `detection_delay_s` is from the first true slip to the
    first alarm. `slip_margin` is 1 without slip and below 0 beyond `task.max_slip_m`. `force_margin` is below 0 for a
    grip that crushes the object, and 1 at the needed grip; if `task.fragile_n` is set, 1 without any force. `opened`:
    the fingers opened since grip was first corrected. `invalid`: something of the run is outside the model's validity,
    whatever the outcome.
    """

    outcome: Outcome
    reason: str
    exit_code: int
    grip_over_needed: float | None = None
    detection_delay_s: float | None = None
    slip_margin: float | None = None
    force_margin: float | None = None
    opened: bool = False
    invalid: bool = False

    @property
    def sentence(self) -> str:
        """The outcome and its reason."""
        return f"{self.outcome}: {self.reason}"

    @property
    def in_grip(self) -> bool:
        """Whether the object is in the grip at the end, whatever its slip and the force on it."""
        return self.outcome in _IN_GRIP

    def as_json(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "outcome": str(self.outcome),
            "reason": self.reason,
            "sentence": self.sentence,
            "exit_code": self.exit_code,
            "grip_over_needed": self.grip_over_needed,
            "detection_delay_s": self.detection_delay_s,
        }


@dataclass(frozen=True, slots=True)
class Ending:
    """The state of the engine at the end of a run.

    `done`: the job is done; `released`: it has opened the gripper on purpose; `grips`: there is a gripper; `rose`: the
    arm was commanded upward. `began_ns` is when grip was first corrected, None if it never was. `contacts` are the
    contact areas since then, as fractions of the image. `load_n` is the last load of a finger, NaN without one.
    `widest_m` is the largest aperture of the gripper. In `held_back` frames `task.fragile_n` limited the grip.
    `slip_wanted`: the job asked for slip.
    """

    done: bool
    released: bool
    grips: bool
    rose: bool
    began_ns: int | None
    contacts: Sequence[float] = ()
    held_back: int = 0
    load_n: float = math.nan
    widest_m: float = math.inf
    slip_wanted: bool = False


def judge(
    figures: Mapping[str, Any],
    truths: Sequence[CellTruth],
    config: RigConfig,
    ending: Ending,
    fault: BaseException | None,
) -> Verdict:
    """Return the verdict on a run.

    `figures` are those of its summary, `truths` the true states of a simulated cell since the start, and `fault` is
    the error or the interrupt that ended the run. Of several outcomes the first in this order counts: stopped, dropped
    or not lifted, crushed, slipped too far, outside the model's validity, held.
    """
    lift = _Lift(figures, truths, config, ending)
    if fault is not None:
        return lift.verdict(
            Outcome.STOPPED, _why_stopped(lift, fault), exit_code=getattr(fault, "exit_code", INTERRUPTED)
        )
    outcome = _place(lift)
    if outcome is Outcome.DROPPED or outcome is Outcome.NOT_LIFTED:
        why = _why_lost(lift)
        return lift.verdict(outcome, f"{why}; outside the model's validity: {lift.invalid}" if lift.invalid else why)
    if outcome is not Outcome.HELD:
        return lift.verdict(outcome, _why_no_lift(outcome))
    if lift.force_margin is not None and lift.force_margin < 0:
        return lift.verdict(Outcome.CRUSHED, _why_crushed(lift))
    if lift.slip_margin is not None and lift.slip_margin < 0:
        limit_mm = 1e3 * config.task.max_slip_m
        why = f"{1e3 * lift.slip_m:.1f} mm of slip, the limit is {limit_mm:.3g} mm (task.max_slip_m){_late(lift, '; ')}"
        return lift.verdict(Outcome.SLIPPED, why)
    if lift.invalid:
        return lift.verdict(Outcome.OUTSIDE, f"{lift.invalid}; the object was in the grip at the end")
    return lift.verdict(Outcome.HELD, _how_held(lift))


class _Lift:
    """The numbers of a run that more than one reason needs."""

    def __init__(
        self, figures: Mapping[str, Any], truths: Sequence[CellTruth], config: RigConfig, ending: Ending
    ) -> None:
        self.figures, self.every, self.config, self.ending = figures, truths, config, ending
        began_ns = ending.began_ns
        self.truths = [t for t in truths if began_ns is not None and t.t_ns >= began_ns]
        self.lifted = [t for t in self.truths if not t.supported]
        self.slip_m: float = figures["slip_distance_m"] or 0.0
        self.needed_n: float = figures["required_normal_force_n"] or 0.0
        self.delay_s: float | None = figures["detection"]["onset_delay_s"]
        self.invalid = "; ".join((figures["simulation"] or {}).get("invalid", ()))
        self.first_n = 0.0
        self.peak_n, self.force_limit_n = self._forces()
        first_m = self.truths[0].aperture_m if self.truths else 0.0
        self.opened_m = max((t.aperture_m for t in self.truths), default=0.0) - first_m
        self.slip_margin = self._slip_margin()
        self.force_margin = self._force_margin()

    def _forces(self) -> tuple[float, float]:
        """Return the peak force a finger and the most that the object withstands (N)."""
        fragile_n = self.config.task.fragile_n
        if fragile_n is not None:
            return max((t.normal_force_n for t in self.every), default=0.0), fragile_n
        # The squeeze of the job itself, before the load, is no failure of the controller.
        self.first_n = self.lifted[0].normal_force_n if self.lifted else 0.0
        peak_n = max((t.normal_force_n for t in self.lifted), default=0.0)
        return peak_n, self.config.task.max_grip_ratio * max(self.needed_n, self.first_n, LEAST_FORCE_N)

    def _slip_margin(self) -> float | None:
        if not self.truths or self.ending.slip_wanted:
            return None
        return 1 - self.slip_m / self.config.task.max_slip_m

    def _force_margin(self) -> float | None:
        if not self.truths or (self.config.task.fragile_n is None and not self.lifted):
            return None
        best_n = 0.0 if self.config.task.fragile_n is not None else self.force_limit_n / self.config.task.max_grip_ratio
        return (self.force_limit_n - self.peak_n) / (self.force_limit_n - best_n)

    def verdict(self, outcome: Outcome, reason: str, *, exit_code: int | None = None) -> Verdict:
        """Return a verdict with the figures of this run."""
        grip_n = self.figures["steady_normal_force_n"] if outcome in _IN_GRIP else self.figures["peak_normal_force_n"]
        return Verdict(
            outcome,
            reason,
            EXIT_CODES[outcome] if exit_code is None else exit_code,
            None if grip_n is None or not self.truths else grip_n / max(self.needed_n, LEAST_FORCE_N),
            self.delay_s,
            self.slip_margin,
            self.force_margin,
            self.opened_m > OPENED_BY_CORRECTION_M,
            bool(self.invalid),
        )


def _place(lift: _Lift) -> Outcome:
    """Return where the object is at the end; `HELD` if it is in the grip."""
    ending, truths = lift.ending, lift.truths
    if not truths and lift.every and lift.every[-1].dropped:
        return Outcome.DROPPED
    if ending.done and ending.released and not (truths and truths[-1].dropped):
        return Outcome.RELEASED
    if truths:
        last = truths[-1]
        if not (last.dropped or last.normal_force_n <= 0 or (ending.rose and last.supported)):
            return Outcome.HELD
        # An object that slides through the fingers and never leaves the table was gripped, and so it counts as dropped.
        gripped = last.dropped or any(t.normal_force_n > 0 for t in truths)
        return Outcome.DROPPED if gripped else Outcome.NOT_LIFTED
    contacts = [area for area in ending.contacts if math.isfinite(area)]
    if not ending.grips or not ending.done or not contacts:
        return Outcome.ENDED
    if contacts[0] < LEAST_CONTACT:
        return Outcome.NOT_LIFTED
    return Outcome.HELD if contacts[-1] >= LOST_SHARE * contacts[0] else Outcome.DROPPED


def _why_stopped(lift: _Lift, fault: BaseException) -> str:
    if isinstance(fault, KeyboardInterrupt):
        return str(fault) or "a keyboard interrupt"
    text = f"{type(fault).__name__}: {fault}"
    widest_m = lift.ending.widest_m - OPENED_BY_CORRECTION_M
    if not lift.truths and lift.every and lift.every[-1].normal_force_n > 0 and lift.every[-1].aperture_m >= widest_m:
        return f"the object is wider than the gripper opens, {_mm(lift.ending.widest_m)}; {text}"
    return text


def _why_no_lift(outcome: Outcome) -> str:
    if outcome is Outcome.RELEASED:
        return "the job opened the gripper on purpose"
    return "the run had no grip to judge"


def _why_lost(lift: _Lift) -> str:
    """Return the most likely cause of an object that is not in the grip at the end."""
    if not lift.truths:
        return _why_lost_unseen(lift)
    if lift.opened_m > OPENED_BY_CORRECTION_M:
        return f"the fingers opened by {1e3 * lift.opened_m:.3g} mm during the lift"
    peak_n, needed_n = max(t.normal_force_n for t in lift.truths), lift.needed_n
    if peak_n <= 0:
        return f"the fingers never touched the object; their aperture was {_mm(lift.truths[-1].aperture_m)}"
    if (why := _force_limit(lift, peak_n)) is not None:
        return why
    short = f"the grip reached {_newtons(peak_n)} of the {_newtons(needed_n)} needed"
    weak = peak_n < needed_n
    if not lift.config.controller.enabled:
        return f"the controller is off, and {short}" if weak else "the controller is off"
    if late := _late(lift):
        return f"{late}, and {short}" if weak else late
    if weak:
        return short
    slip = f"{1e3 * lift.slip_m:.3g} mm of slip"
    return f"{slip} before the grip of {_newtons(peak_n)} took effect; needed: {_newtons(needed_n)}"


def _why_lost_unseen(lift: _Lift) -> str:
    """Return the cause as far as the sensors show it: without the truth, or if the object fell in the grasp."""
    contacts = [area for area in lift.ending.contacts if math.isfinite(area)]
    if lift.every or not contacts:
        return "the object fell before the lift"
    if contacts[0] < LEAST_CONTACT:
        return f"the fingers touched nothing: contact covered {contacts[0]:.1%} of the image before the lift"
    if lift.ending.held_back:
        return _held_back(lift)
    return f"contact fell to {contacts[-1] / contacts[0]:.0%} of that before the lift"


def _force_limit(lift: _Lift, peak_n: float) -> str | None:
    """Return that a limit of the force is too low for the object, None if no limit is the cause."""
    task, needed_n = lift.config.task, lift.needed_n
    limits = {"safety.max_grip_force_n": lift.config.safety.max_grip_force_n, "task.grip_force_n": task.grip_force_n}
    if task.fragile_n is not None:
        limits["task.fragile_n"] = task.fragile_n
    key = min(limits, key=lambda name: limits[name])
    if limits[key] < needed_n and peak_n < needed_n:
        frames = f"; it held the fingers back in {lift.ending.held_back} frames" if lift.ending.held_back else ""
        return f"the force limit of {_newtons(limits[key])} ({key}) cannot hold {_newtons(needed_n)}{frames}"
    return _held_back(lift) if lift.ending.held_back and peak_n < needed_n else None


def _held_back(lift: _Lift) -> str:
    return (
        f"task.fragile_n = {lift.config.task.fragile_n:g} N kept the fingers from closing further in "
        f"{lift.ending.held_back} frames"
    )


def _late(lift: _Lift, before: str = "") -> str:
    """Return that slip was detected late or not at all, "" if it was detected in time or there was none."""
    if lift.delay_s is not None:
        return f"{before}slip was not detected for {lift.delay_s:.2g} s" if lift.delay_s > LATE_DETECTION_S else ""
    onset_s = lift.figures["slip_onset_s"]
    if onset_s is None:
        return ""
    lasted_s = (lift.truths[-1].t_ns - lift.truths[0].t_ns) * 1e-9 - onset_s
    return f"{before}slip was never detected in the {lasted_s:.2g} s from its onset to the end"


def _why_crushed(lift: _Lift) -> str:
    peak = f"the peak grip of {_newtons(lift.peak_n)} a finger"
    if lift.config.task.fragile_n is not None:
        return f"{peak} exceeds the {lift.config.task.fragile_n:g} N that the object withstands (task.fragile_n)"
    ratio = lift.config.task.max_grip_ratio
    times = ratio * lift.peak_n / lift.force_limit_n
    base = f"the first grip of {_newtons(lift.first_n)}" if lift.first_n > lift.needed_n else "the needed grip"
    return f"{peak} is {times:.1f} times {base}, the limit is {ratio:g} (task.max_grip_ratio)"


def _how_held(lift: _Lift) -> str:
    if not lift.truths:
        if lift.ending.rose and lift.ending.load_n <= LEAST_EVIDENCE_N:
            return (
                "contact remained until the end, but the arm rose without a load: the object weighs less than "
                f"{_newtons(2 * LEAST_EVIDENCE_N)}, or stayed behind (raise task.first_squeeze_m)"
            )
        return "contact remained until the end"
    steady_n = lift.figures["steady_normal_force_n"] or 0.0
    times = steady_n / max(lift.needed_n, LEAST_FORCE_N)
    slid = f"after {1e3 * lift.slip_m:.2g} mm of slip" + (" that the job wanted" if lift.ending.slip_wanted else "")
    return f"with {times:.2g} times the greatest force needed, {slid}"


def _newtons(force_n: float) -> str:
    return f"{force_n:.3g} N" if force_n < 999 else f"{force_n:.0f} N"


def _mm(aperture_m: float) -> str:
    return f"{1e3 * aperture_m:.3g} mm"
