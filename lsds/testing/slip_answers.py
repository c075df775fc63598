"""Checks of the answers of detectors and estimators: types, ranges, abstention."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from lsds.contracts import Detection, Observation, SlipEstimate
from lsds.support.numeric import is_number
from lsds.testing.bench import Bench
from lsds.testing.feeding import build
from lsds.testing.stimulus import Name, degraded, later, observations

SEQUENCES: tuple[Name, ...] = ("untouched", "slides", "turns")
FASTEST_M_S = 1.0
"""Maximum plausible estimate, m/s. The stimulus slides at 8 mm/s: faster estimates are in other units."""
FASTEST_RAD_S = 100.0
"""Maximum plausible estimate, rad/s. The stimulus turns at 0.8 rad/s: faster estimates are in other units."""
LIKELY_CONFIDENCE = 0.5
"""Minimum confidence of a slip that is reported as likely."""
STILL_M_S = 0.01
"""Maximum median estimate for a gel without contact, m/s; chosen."""
RECOVERY_ROUNDS = 3
"""Number of times that a sound sequence is shown after a frame that lacks something; chosen."""
LEAST_APART_M_S = 1e-3
"""Difference of speed and velocity that two outputs of one model may have, m/s; chosen."""
STILL_RAD_S = 2.0
"""Maximum median estimate for a gel without contact, rad/s; chosen."""


def check_detections_are_sound(bench: Bench) -> None:
    """Every answer is a Detection: slip True, False or None, confidence in [0, 1], a score if it decides."""
    answers = list(_answers(bench))
    _assert_sound(iter(answers), _problem_of_detection)
    decided = [(where, answer) for where, answer in answers if answer.slip is not None]
    # A hysteresis, or a slip that has to last, contradicts the threshold in a few frames.
    contradict = [(where, answer) for where, answer in decided if _contradicts(answer)]
    if 2 * len(contradict) > len(decided):
        where, answer = contradict[0]
        raise AssertionError(
            f"{where}: slip is {answer.slip} with a score of {answer.score:.3g} and a threshold of "
            f"{answer.threshold:.3g}, and so in {len(contradict)} of {len(decided)} frames; report slip above the "
            "threshold, and none below"
        )


def check_detector_survives_what_is_lacking(bench: Bench) -> None:
    """NaN and lost markers never raise, and give an abstention or a sound answer; sound frames are answered again."""
    _assert_sound(_degraded(bench), _problem_of_detection)
    _assert_recovers(bench, lambda detection: detection.slip is not None)


def check_detector_claims_no_slip_of_nothing(bench: Bench) -> None:
    """Without contact, or without any marker followed, it abstains, denies slip or claims it with low confidence."""
    nothing = degraded()
    alone = [nothing["no marker followed"], nothing["a black image"], nothing["the first frame, without a velocity"]]
    for inputs in (observations("untouched"), *([one] for one in alone)):
        detector = build(bench)
        for i, observation in enumerate(inputs):
            detection = detector.update(observation)
            assert not (detection.slip and detection.confidence > LIKELY_CONFIDENCE), (
                f"frame {i}: nothing touches or is followed, and it reports slip with confidence "
                f"{detection.confidence:.2f} (limit {LIKELY_CONFIDENCE}); abstain with slip=None"
            )


def check_estimates_are_sound(bench: Bench) -> None:
    """Every answer is a SlipEstimate: it abstains, or is finite, below 1 m/s here, with positive sigmas."""
    _assert_sound(_answers(bench), _problem_of_estimate)


def check_estimator_survives_what_is_lacking(bench: Bench) -> None:
    """NaN and lost markers never raise, and give an abstention or a sound answer; sound frames are answered again."""
    _assert_sound(_degraded(bench), _problem_of_estimate)
    _assert_recovers(bench, lambda estimate: not estimate.abstained)


def check_estimator_finds_no_slip_of_nothing(bench: Bench) -> None:
    """Without any marker followed it abstains or is near zero; so it is mostly while nothing touches the gel."""
    estimate = build(bench).update(degraded()["no marker followed"])
    _assert_still("no marker is followed", [estimate])
    estimator = build(bench)
    _assert_still("nothing touches the gel", [estimator.update(seen) for seen in observations("untouched")])


def _assert_sound(answers: Iterator[tuple[str, Any]], problem_of: Callable[[Any], str]) -> None:
    for where, answer in answers:
        problem = problem_of(answer)
        assert not problem, f"{where}: {problem}"


def _assert_recovers(bench: Bench, answers: Callable[[Any], bool]) -> None:
    """Assert that an algorithm that answers a sequence also answers it after a frame that lacks something."""
    sound = observations("slides")
    for what, lacking in (("nothing", None), *degraded().items()):
        algorithm = build(bench)
        for observation in (*sound, *([] if lacking is None else [later(lacking, 1)])):
            algorithm.update(observation)
        answered = [
            answers(algorithm.update(later(observation, again * len(sound) + 1)))
            for again in range(1, 1 + RECOVERY_ROUNDS)
            for observation in sound
        ]
        if lacking is None and not any(answered):
            return  # It does not answer this sequence at all.
        assert any(answered), (
            f"after {what} it abstains for {len(answered)} sound frames, which it answers otherwise; discard NaN "
            "before it reaches the state"
        )


def _assert_still(what: str, estimates: Sequence[SlipEstimate]) -> None:
    estimated = [estimate for estimate in estimates if not estimate.abstained]
    if 2 * len(estimated) <= len(estimates):
        return
    speed = float(np.median([estimate.speed_m_s for estimate in estimated]))
    rate = float(np.median([abs(estimate.angular_rad_s) for estimate in estimated]))
    assert speed < STILL_M_S, (
        f"{what}, and the median estimate is {speed:.3g} m/s (limit {STILL_M_S}); abstain (return ABSTAINED), and use "
        "metres per second"
    )
    assert not rate >= STILL_RAD_S, (
        f"{what}, and the median estimate is {rate:.3g} rad/s (limit {STILL_RAD_S}); abstain (return ABSTAINED), and "
        "use radians per second"
    )


def _answers(bench: Bench) -> Iterator[tuple[str, Any]]:
    for name in SEQUENCES:
        algorithm = build(bench)
        for i, observation in enumerate(observations(name)):
            yield f"sequence {name!r}, frame {i}", algorithm.update(observation)


def _degraded(bench: Bench) -> Iterator[tuple[str, Any]]:
    """Yield the answers to each defect alone and within a sequence, and to the sound frame after it."""
    sound = observations("slides")
    for what, lacking in degraded().items():
        yield what, _asked(build(bench), lacking, what)
        algorithm = build(bench)
        for observation in sound[:-1]:
            algorithm.update(observation)
        yield f"{what}, within a sequence", _asked(algorithm, lacking, what)
        yield f"{what}, the frame after it", _asked(algorithm, sound[-1], what)


def _asked(algorithm: Any, observation: Observation, what: str) -> Any:
    try:
        return algorithm.update(observation)
    except Exception as error:
        raise AssertionError(
            f"{what}: update() raised {type(error).__name__}: {error}; abstain where something is lacking"
        ) from error


def _problem_of_detection(detection: Any) -> str:
    if not isinstance(detection, Detection):
        return f"update() returned {type(detection).__name__} {detection!r}; return a Detection"
    if detection.slip is not None and not isinstance(detection.slip, bool | np.bool_):
        return f"slip is {detection.slip!r}; it must be True, False or None (abstains)"
    if not is_number(detection.confidence) or not 0 <= detection.confidence <= 1:
        return f"confidence is {detection.confidence!r}; it must be a number in [0, 1], 0 for an abstention"
    if not (
        is_number(detection.probability) and (math.isnan(detection.probability) or 0 <= detection.probability <= 1)
    ):
        return f"probability is {detection.probability!r}; it must be in [0, 1], or NaN if the detector estimates none"
    if not is_number(detection.score) or (detection.slip is not None and not math.isfinite(detection.score)):
        return f"slip is {detection.slip} by a score of {detection.score!r}; it must be finite (or abstain: slip=None)"
    if not is_number(detection.threshold) or not math.isfinite(detection.threshold):
        return f"threshold is {detection.threshold!r}; it must be finite"
    return ""


def _contradicts(detection: Detection) -> bool:
    above = detection.score > detection.threshold
    return detection.score != detection.threshold and bool(detection.slip) != above


def _problem_of_estimate(estimate: Any) -> str:
    if not isinstance(estimate, SlipEstimate):
        return f"update() returned {type(estimate).__name__} {estimate!r}; return a SlipEstimate"
    if not isinstance(estimate.abstained, bool | np.bool_):
        return f"abstained is {estimate.abstained!r}; it must be True or False"
    if estimate.abstained:
        return ""
    speeds = {
        "velocity_m_s[0]": estimate.velocity_m_s[0],
        "velocity_m_s[1]": estimate.velocity_m_s[1],
        "speed_m_s": estimate.speed_m_s,
    }
    for name, value in speeds.items():
        if not is_number(value) or not math.isfinite(value):
            return f"{name} is {value!r}; it must be finite (or abstain: return ABSTAINED)"
        if abs(value) >= FASTEST_M_S:
            return f"{name} is {value:.3g} and must be below {FASTEST_M_S} m/s here (8 mm/s are shown); use metres"
    if estimate.speed_m_s < 0:
        return f"speed_m_s is {estimate.speed_m_s:.3g}; it must not be negative"
    if _disagrees(estimate):
        return (
            f"speed_m_s is {estimate.speed_m_s:.3g}, and velocity_m_s {estimate.velocity_m_s} is "
            f"{math.hypot(*estimate.velocity_m_s):.3g} m/s; report one motion by both"
        )
    rate = estimate.angular_rad_s
    if not is_number(rate) or abs(rate) >= FASTEST_RAD_S:
        return f"angular_rad_s is {rate!r} and must be below {FASTEST_RAD_S} rad/s here; use radians"
    stds = (*estimate.velocity_std_m_s, estimate.speed_std_m_s)
    if not all(is_number(std) and math.isfinite(std) and std > 0 for std in stds):
        return f"velocity_std_m_s and speed_std_m_s are {stds}; one sigma is finite and positive"
    if math.isfinite(rate) and not (is_number(estimate.angular_std_rad_s) and estimate.angular_std_rad_s > 0):
        return f"angular_std_rad_s is {estimate.angular_std_rad_s!r}; one sigma is positive"
    return _problem_of_covariance(getattr(estimate, "covariance", None))


def _disagrees(estimate: SlipEstimate) -> bool:
    """Whether speed and velocity differ by more than their standard deviations and a model's two outputs allow."""
    stds = (*estimate.velocity_std_m_s, estimate.speed_std_m_s)
    if not all(is_number(std) and math.isfinite(std) for std in stds):
        return False
    apart = abs(estimate.speed_m_s - math.hypot(*estimate.velocity_m_s))
    return apart > 3 * math.hypot(*stds) + LEAST_APART_M_S


def _problem_of_covariance(covariance: Any) -> str:
    """Return what is wrong with the covariance of an estimate that has one."""
    if covariance is None:
        return ""
    matrix = np.asarray(covariance, float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not np.isfinite(matrix).all():
        return f"covariance is {matrix.tolist()}; it must be a finite square matrix"
    scale = float(np.abs(matrix).max())
    if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9 * scale):
        return f"covariance {matrix.tolist()} is not symmetric; use (C + C.T) / 2"
    least = float(np.linalg.eigvalsh(matrix).min())
    if least < -1e-9 * scale:
        return f"covariance {matrix.tolist()} has the eigenvalue {least:.3g}; it must be positive semidefinite"
    return ""


DETECTOR_CHECKS = (
    check_detections_are_sound,
    check_detector_survives_what_is_lacking,
    check_detector_claims_no_slip_of_nothing,
)
ESTIMATOR_CHECKS = (
    check_estimates_are_sound,
    check_estimator_survives_what_is_lacking,
    check_estimator_finds_no_slip_of_nothing,
)
