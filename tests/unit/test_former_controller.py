"""Controllers of contract 1 run for one more release, with a warning."""

from __future__ import annotations

import warnings

import pytest

from lsds.contracts import ABSTAINED, BackendSpec, Detection, GripEstimate, GripInput, GripTask, Slide
from lsds.contracts.former import FormerController, as_controller
from lsds.registry.contract import check_contract
from lsds.testing.grips import grip_inputs

SLIDE = Slide(0.01)
SLIPS = Detection(True, 0.9, 0.5, 0.8)


class Former:
    may_open = True
    minds_force = True
    held_back = True

    def __init__(self):
        self.states = []

    def update(self, state):
        self.states.append(state)
        return state.aperture_m - 1e-3

    def reset(self):
        self.states.clear()


class Present:
    may_open = limits_force = False

    def update(self, grip, wanted):
        return None

    def reset(self):
        pass


def test_a_former_controller_is_wrapped_with_a_warning_that_names_it_and_the_remedy():
    with pytest.warns(FutureWarning, match=r"controller 'acme'.* write update\(grip, wanted\)"):
        controller = as_controller(Former(), "controller 'acme'")
    assert isinstance(controller, FormerController)
    assert controller.may_open
    assert controller.limits_force
    assert controller.held_back


def test_a_present_controller_is_left_alone():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        present = Present()
        assert as_controller(present, "controller 'acme'") is present


def test_it_gets_every_field_of_the_former_input():
    former = Former()
    grip = GripEstimate(
        t_ns=7,
        dt_s=0.04,
        detection=SLIPS,
        estimate=ABSTAINED,
        commanded_m=0.02,
        measured_m=0.021,
        aperture_m=0.022,
        touch_m=0.03,
    )
    wanted = GripTask(probes=True, slide=SLIDE, fragile_n=5.0, resolution_m=2e-4)
    assert FormerController(former).update(grip, wanted) == pytest.approx(0.019)
    assert former.states == [
        GripInput(7, 0.04, SLIPS, ABSTAINED, 0.02, 0.021, (), 0.03, 0.022, True, 5.0, 2e-4, SLIDE, grip)
    ]


def test_it_runs_on_the_inputs_of_the_kit():
    controller = FormerController(Former())
    assert all(controller.update(*given) is not None for given in grip_inputs("slides"))
    assert BackendSpec("controller", "acme", "acme:Former", contract=1).contract == 1


def test_a_controller_need_not_declare_that_it_never_opens():
    class Silent:
        def update(self, grip, wanted):
            return None

        def reset(self):
            pass

    check_contract("controller 'acme'", "controller", Silent())
