"""Every mistake is found by its check, with a remedy, and an honest algorithm passes all of them."""

from __future__ import annotations

import logging
import random

import mutants_detectors
import mutants_estimators
import mutants_tasks
import mutants_trackers
import numpy as np
import pytest
from catching import CAUGHT
from fake_cell import plugin
from honest import HonestController, HonestDetector, HonestEstimator, HonestJob, HonestTracker

from lsds.contracts import BackendSpec
from lsds.registry import PluginHost
from lsds.testing import Bench, cases
from lsds.testing import algorithms as every
from lsds.testing.option_keys import OPTION_CHECKS
from lsds.testing.process_state import kept_state

MODULES = (mutants_detectors, mutants_estimators, mutants_trackers, mutants_tasks)
HONEST = {
    "detector": HonestDetector,
    "estimator": HonestEstimator,
    "tracker": HonestTracker,
    "controller": HonestController,
    "job": HonestJob,
}


def bench(kind, algorithm):
    host = PluginHost(entry_points=[])
    spec = BackendSpec(kind, algorithm.__name__.lower(), f"{algorithm.__module__}:{algorithm.__name__}")
    host.register(plugin(spec), distribution="mutants", name="mutants")
    return Bench(kind, spec.name, host=host)


HONEST_CASES = [case for kind, algorithm in HONEST.items() for case in cases(bench(kind, algorithm))]


@pytest.mark.parametrize("case", HONEST_CASES, ids=lambda case: case.id)
def test_an_honest_algorithm_passes(case):
    case()


@pytest.mark.parametrize("mutant", CAUGHT, ids=lambda mutant: mutant.__name__)
def test_a_mutant_is_caught_by_the_check_of_its_mistake(mutant):
    kind, check, match = CAUGHT[mutant]
    found = bench(kind, mutant)
    assert check in [case.check for case in cases(found)]
    with pytest.raises(AssertionError, match=match) as caught:
        check(found)
    remedies = ("; ", "(or abstain")
    assert any(remedy in str(caught.value) for remedy in remedies), f"no remedy in: {caught.value}"


def test_mutants_are_registered():
    assert {mutant.__module__ for mutant in CAUGHT} == {module.__name__ for module in MODULES}
    assert len(CAUGHT) > 60


def test_every_check_catches_a_mutant():
    checks = {case.check for case in HONEST_CASES} - {*OPTION_CHECKS}
    assert {check.__name__ for check in checks} == {check.__name__ for _, check, _ in CAUGHT.values()}


STATEFUL = [mutant for mutant, (_, check, _) in CAUGHT.items() if check is every.check_leaves_global_state]


def process_state():
    root = logging.getLogger()
    return (
        [part.tolist() if hasattr(part, "tolist") else part for part in np.random.get_state()],  # noqa: NPY002
        random.getstate(),
        np.geterr(),
        (root.level, list(root.handlers), list(root.filters), logging.root.manager.disable),
    )


@pytest.mark.parametrize("mutant", STATEFUL, ids=lambda mutant: mutant.__name__)
def test_the_check_of_global_state_puts_it_back(mutant):
    kind, check, match = CAUGHT[mutant]
    before = process_state()
    with pytest.raises(AssertionError, match=match):
        check(bench(kind, mutant))
    assert process_state() == before


@pytest.mark.parametrize(
    "mutant", [mutants_detectors.SeedsTheGlobalGenerator, mutants_detectors.SilencesNumpy], ids=lambda m: m.__name__
)
def test_a_change_shows_in_a_process_that_is_in_that_state_already(mutant):
    kind, check, match = CAUGHT[mutant]
    with kept_state():
        np.random.seed(1)  # noqa: NPY002
        np.seterr(invalid="ignore")
        with pytest.raises(AssertionError, match=match):
            check(bench(kind, mutant))
