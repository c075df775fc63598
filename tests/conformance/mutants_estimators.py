"""Estimators with one mistake each."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from catching import caught
from honest import HonestEstimator

from lsds.contracts import ABSTAINED, SlipEstimate
from lsds.testing import algorithms as every
from lsds.testing import slip_answers


def bent(estimate, **changes):
    return estimate if estimate.abstained else replace(estimate, **changes)


@caught("estimator", slip_answers.check_estimates_are_sound, "one sigma is finite and positive")
class NegativeSigma(HonestEstimator):
    def update(self, observation):
        return bent(super().update(observation), speed_std_m_s=-1e-3)


@caught("estimator", slip_answers.check_estimates_are_sound, "one sigma is finite and positive")
class SigmaOfZero(HonestEstimator):
    def update(self, observation):
        return bent(super().update(observation), velocity_std_m_s=(0.0, 0.0))


@caught("estimator", slip_answers.check_estimates_are_sound, "report one motion by both")
class SpeedInAnotherUnit(HonestEstimator):
    def update(self, observation):
        found = super().update(observation)
        return bent(found, speed_m_s=10 * found.speed_m_s)


@caught("estimator", slip_answers.check_estimator_survives_what_is_lacking, "discard NaN before it reaches")
class AbstainsForEverAfterNan(HonestEstimator):
    def update(self, observation):
        found = super().update(observation)
        self.lost = getattr(self, "lost", False) or bool(np.isnan(observation.features.values).all())
        return ABSTAINED if self.lost else found

    def reset(self):
        super().reset()
        self.lost = False


@dataclass(frozen=True)
class WithCovariance(SlipEstimate):
    covariance: tuple = ()


def with_covariance(estimate, matrix):
    if estimate.abstained:
        return estimate
    names = SlipEstimate.__dataclass_fields__
    return WithCovariance(**{name: getattr(estimate, name) for name in names}, covariance=matrix)


@caught("estimator", slip_answers.check_estimates_are_sound, "is not symmetric")
class AsymmetricCovariance(HonestEstimator):
    def update(self, observation):
        return with_covariance(super().update(observation), ((1e-6, 5e-7), (0.0, 1e-6)))


@caught("estimator", slip_answers.check_estimates_are_sound, "eigenvalue -1e-06")
class IndefiniteCovariance(HonestEstimator):
    def update(self, observation):
        return with_covariance(super().update(observation), ((1e-6, 2e-6), (2e-6, 1e-6)))


@caught("estimator", slip_answers.check_estimates_are_sound, "use metres")
class Millimetres(HonestEstimator):
    def update(self, observation):
        found = super().update(observation)
        x, y = found.velocity_m_s
        return bent(found, velocity_m_s=(1e3 * x, 1e3 * y), speed_m_s=1e3 * found.speed_m_s)


@caught("estimator", slip_answers.check_estimates_are_sound, "use radians")
class MillidegreesPerSecond(HonestEstimator):
    def update(self, observation):
        return bent(super().update(observation), angular_rad_s=1e3 * math.degrees(0.8))


@caught("estimator", slip_answers.check_estimates_are_sound, r"velocity_m_s\[0\] is nan")
class NanThatDoesNotAbstain(HonestEstimator):
    def update(self, observation):
        return replace(super().update(observation), velocity_m_s=(math.nan, math.nan), abstained=False)


@caught("estimator", slip_answers.check_estimator_finds_no_slip_of_nothing, "no marker is followed")
class EstimatesFromNothing(HonestEstimator):
    def update(self, observation):
        found = super().update(observation)
        return SlipEstimate((0.05, 0.0), (0.1, 0.1), 0.0, 1.0, 0.05, 0.1) if found is ABSTAINED else found


@caught("estimator", slip_answers.check_estimator_survives_what_is_lacking, "raised ZeroDivisionError")
class DividesByTheMarkersInContact(HonestEstimator):
    def update(self, observation):
        if observation.contact is None:
            1 / 0  # noqa: B018
        return super().update(observation)


@caught("estimator", every.check_reset_equals_a_new_build, "after reset")
class RemembersItsWindow(HonestEstimator):
    def reset(self):
        self.speeds = getattr(self, "speeds", [])


@caught("estimator", every.check_leaves_global_state, "numpy's error state")
class RaisesOnNumericalErrors(HonestEstimator):
    def __init__(self, options, context):
        super().__init__(options, context)
        np.seterr(all="raise")
