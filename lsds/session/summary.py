"""The summary figures of a run, which `lsds run` prints and writes as JSON.

Figures that need the truth are available from the simulated cell only and are None on a real one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from lsds.clock import nanoseconds, seconds
from lsds.contracts import FidelityReporting
from lsds.session.verdict import Ending, Outcome, Verdict, judge

if TYPE_CHECKING:
    from lsds.contracts import CellTruth
    from lsds.runtime.engine import Engine
    from lsds.runtime.histogram import LogHistogram
    from lsds.runtime.rig import Rig
    from lsds.session.record import Sample

#: Slip speeds below this count as no slip, m/s.
AT_REST_M_S = 1e-3
#: A pose source must see gripper and object in at least one of this many frames at the end of a run.
LATELY = 5
#: The steady grip is the mean of so much time at the end, s.
STEADY_GRIP_S = 0.5


@dataclass(frozen=True, slots=True)
class Slip:
    """True slip during lift and hold, SI units; None if there was no slip or it did not end."""

    distance_m: float
    onset_s: float | None
    time_to_arrest_s: float | None
    peak_speed_m_s: float


def summarise(
    rig: Rig,
    engine: Engine,
    samples: Sequence[Sample],
    every_truth: Sequence[CellTruth],
    *,
    wall_s: float,
    simulated_s: float,
    fault: BaseException | None,
) -> tuple[dict[str, Any], Verdict]:
    """Return the run as plain values, ready for JSON, and the verdict on it. `wall_s` is the real duration of the run,
    `simulated_s` the duration on the rig's clock."""
    acting = [sample for sample in samples if sample.acting]
    begun = engine.acting_since_ns
    truths = [truth for truth in every_truth if begun is not None and truth.t_ns >= begun]
    moving = [sample for sample in acting if sample.true_speed_m_s > AT_REST_M_S]
    slip = _slip(truths)
    backends = {kind: backend.spec.name for kind, backend in rig.backends.items()}
    backends["job"] = engine.job_name
    scheduled = engine.scheduler.statistics()
    figures = {
        "fault": None if fault is None else _reason(fault),
        "stop_report": engine.stop_report or None,
        "missing": _missing(rig, engine, acting),
        "figures_are": "simulated" if rig.cell is not None else "measured",
        "simulation": rig.cell.fidelity() if isinstance(rig.cell, FidelityReporting) else None,
        "slip_distance_m": slip.distance_m if slip else None,
        "slip_onset_s": slip.onset_s if slip else None,
        "time_to_arrest_s": slip.time_to_arrest_s if slip else None,
        "peak_slip_speed_m_s": slip.peak_speed_m_s if slip else None,
        "peak_normal_force_n": max((t.normal_force_n for t in truths), default=None),
        "steady_normal_force_n": _steady(truths),
        "required_normal_force_n": max((t.required_normal_force_n for t in truths), default=None),
        "seen_slip_distance_m": _seen_slip(acting),
        "severity_mae_m_s": _severity_mae(acting),
        "severity_zero_predictor_mae_m_s": _zero_mae(acting),
        "severity_moving_mae_m_s": _severity_mae(moving),
        "severity_moving_zero_predictor_mae_m_s": _zero_mae(moving),
        "detection": _detection(acting, begun, slip),
        "called_slip": _called_slip(samples, every_truth),
        "aperture_m": {
            "at_lift": _measured(acting[0]) if acting else None,
            "at_end": _measured(acting[-1]) if acting else None,
        },
        "markers": {
            "reference": engine.perception.reference.count if engine.perception.reference else None,
            "kept_fraction": _mean([sample.kept_fraction for sample in samples]),
        },
        "faults": [
            {"backend": section.backend, "moment": fault.moment, "began_s": _began_s(rig, fault.moment)}
            for section, fault in rig.faults
        ],
        "corrections": sum(sample.command_m is not None for sample in acting),
        "guard": asdict(engine.guard.counts),
        "cycles": len(samples),
        "unusable_frames": engine.unusable_frames,
        "skipped_frames": sum(line.skipped_frames for line in engine.lines),
        "overruns": sum(task.overruns for task in scheduled),
        "simulated_s" if rig.virtual else "duration_s": simulated_s,
        "backends": backends,
        "seed": rig.config.seed,
        "timing": {
            "wall_s": wall_s,
            "imprint_us": _microseconds(engine.lines[0].imprint.durations_ns),
            "tasks": {
                task.name: {
                    "runs": task.runs,
                    "overruns": task.overruns,
                    "mean_us": task.mean_ns / 1e3,
                    "p99_us": task.p99_ns / 1e3,
                    "max_us": task.max_ns / 1e3,
                    "max_lateness_us": task.max_lateness_ns / 1e3,
                }
                for task in scheduled
            },
        },
        "frame_to_command_us": _microseconds(engine.frame_to_command),
        "realtime_factor": simulated_s / wall_s if wall_s > 0 else None,
    }
    verdict = judge(figures, every_truth, rig.config, _ending(engine, samples), fault)
    judged = {
        "outcome": _word(verdict, fault),
        "outcome_reason": verdict.reason if verdict.outcome not in (Outcome.HELD, Outcome.STOPPED) else None,
        "verdict": verdict.as_json(),
    }
    return judged | figures, verdict


def _word(verdict: Verdict, fault: BaseException | None) -> str:
    """Return the outcome for the key `outcome`, which has always called a run that an error stopped a "fault"."""
    is_error = verdict.outcome is Outcome.STOPPED and not isinstance(fault, KeyboardInterrupt)
    return "fault" if is_error else str(verdict.outcome)


def _ending(engine: Engine, samples: Sequence[Sample]) -> Ending:
    """Return what the engine knows at the end, for the verdict."""
    acting = [sample for sample in samples if sample.acting]
    return Ending(
        done=engine.done,
        released=engine.released,
        grips=engine.grips,
        rose=engine.rig.arm is not None and any(sample.rising for sample in acting),
        began_ns=engine.acting_since_ns,
        contacts=[sample.contact_fraction for sample in acting],
        held_back=engine.held_back_frames,
        load_n=next((each.load_n for each in reversed(acting) if math.isfinite(each.load_n)), math.nan),
        widest_m=math.inf if engine.rig.gripper is None else engine.rig.gripper.spec.stroke_m,
        slip_wanted=engine.slip_wanted,
    )


def _began_s(rig: Rig, moment: str) -> float | None:
    """Return when a moment of the run came, by the rig's clock, None where it did not come."""
    began_ns = rig.stages.began_ns(moment)
    return None if began_ns is None else seconds(began_ns)


def _reason(fault: BaseException) -> str:
    if isinstance(fault, KeyboardInterrupt):
        return str(fault) or "stopped by a keyboard interrupt"
    return f"{type(fault).__name__}: {fault}"


def _slip(truths: Sequence[CellTruth]) -> Slip | None:
    if not truths:
        return None
    speeds = [math.hypot(*truth.slip_velocity_m_s) for truth in truths]
    slipping = [i for i, speed in enumerate(speeds) if speed > AT_REST_M_S]
    distance = truths[-1].slip_distance_m - truths[0].slip_distance_m
    if not slipping:
        return Slip(distance, None, None, max(speeds))
    first, last = slipping[0], slipping[-1]
    # Slip that ends because the fingers have opened was not arrested.
    arrested = last + 1 < len(truths) and not truths[-1].dropped and truths[-1].normal_force_n > 0
    arrest = seconds(truths[last + 1].t_ns - truths[first].t_ns) if arrested else None
    return Slip(distance, seconds(truths[first].t_ns - truths[0].t_ns), arrest, max(speeds))


def _seen_slip(acting: Sequence[Sample]) -> float | None:
    """Slip during lift and hold measured by a pose source (m), None if it did not see gripper and object."""
    seen = [s.seen_slip_m for s in acting if math.isfinite(s.seen_slip_m)]
    # A pose source that lost the bodies on the way has not measured the whole slip.
    blind = not any(math.isfinite(s.seen_slip_m) for s in acting[-LATELY:])
    return None if blind or len(seen) < 2 else seen[-1] - seen[0]


def _missing(rig: Rig, engine: Engine, acting: Sequence[Sample]) -> dict[str, str]:
    """Return the figures that a device of the rig should have given and did not, each with the reason."""
    if rig.pose_source is None or not acting or _seen_slip(acting) is not None:
        return {}
    why = engine.pose_problem or "it did not see the bodies 'gripper' and 'object' at the end"
    return {"seen_slip_distance_m": f"pose source '{rig.config.section('pose_source').backend}': {why}"}


def _severity_mae(acting: Sequence[Sample]) -> float | None:
    """Mean absolute error of the estimated slip speed over lift and hold, without frames in which it abstained."""
    errors = [abs(s.speed_m_s - s.true_speed_m_s) for s in acting]
    return _mean([error for error in errors if math.isfinite(error)])


def _zero_mae(acting: Sequence[Sample]) -> float | None:
    """The same error on the same frames of an estimator that always returns zero, as a trivial baseline."""
    judged = [s for s in acting if math.isfinite(s.speed_m_s)]
    return _mean([s.true_speed_m_s for s in judged if math.isfinite(s.true_speed_m_s)])


def _detection(acting: Sequence[Sample], begun_ns: int | None, slip: Slip | None) -> dict[str, Any]:
    """Frames by true slip and by the detector's answer; abstentions count as neither.

    An alarm is a frame that the belief calls slip. `onset_delay_s` is from the true onset to the first alarm after it,
    camera and computing included; alarms of the lift before the onset are `early_alarms`.
    """
    counts = {"true_positive": 0, "false_positive": 0, "true_negative": 0, "false_negative": 0, "abstained": 0}
    for sample in acting:
        decided = sample.slip
        if math.isnan(sample.true_speed_m_s):
            continue
        slips = sample.true_speed_m_s > AT_REST_M_S
        if decided is None:
            counts["abstained"] += 1
        else:
            counts[f"{'true' if decided == slips else 'false'}_{'positive' if decided else 'negative'}"] += 1
    if begun_ns is None or slip is None or slip.onset_s is None:
        return {**counts, "onset_delay_s": None, "early_alarms": sum(s.called_slip is True for s in acting)}
    onset_ns = begun_ns + nanoseconds(slip.onset_s)
    alarms = [sample.t_ns for sample in acting if sample.called_slip]
    after = [t_ns for t_ns in alarms if t_ns >= onset_ns]
    delay = seconds(after[0] - onset_ns) if after else None
    return {**counts, "onset_delay_s": delay, "early_alarms": len(alarms) - len(after)}


def _called_slip(samples: Sequence[Sample], truths: Sequence[CellTruth]) -> dict[str, Any] | None:
    """Frames that the belief called slip, of those in which it or the detector answered, since the job first lifted or
    corrected; all frames where it did neither. `slipped_m` is how far the object truly slipped meanwhile. None without
    frames."""
    begun = next((at for at, sample in enumerate(samples) if sample.rising or sample.acting), 0)
    since = samples[begun:]
    if not since:
        return None
    decided = [sample.called_slip for sample in since if sample.called_slip is not None]
    distances = [truth.slip_distance_m for truth in truths if truth.t_ns >= since[0].t_ns]
    return {
        "slip": sum(decided),
        "answered": len(decided),
        "lifted": any(sample.rising for sample in since),
        "slipped_m": distances[-1] - distances[0] if distances else None,
    }


def _measured(sample: Sample) -> float | None:
    return sample.measured_m if math.isfinite(sample.measured_m) else None


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _microseconds(histogram: LogHistogram) -> dict[str, float | None]:
    if not histogram.count:
        return {"p50": None, "p99": None, "mean": None}
    return {
        "p50": histogram.quantile(0.5) / 1e3,
        "p99": histogram.quantile(0.99) / 1e3,
        "mean": histogram.mean / 1e3,
    }


def _steady(truths: Sequence[CellTruth]) -> float | None:
    """Return the normal force of a finger at the end; None where the object is not held then."""
    if not truths or truths[-1].dropped:
        return None
    begins = truths[-1].t_ns - nanoseconds(STEADY_GRIP_S)
    return _mean([truth.normal_force_n for truth in truths if truth.t_ns >= begins])
