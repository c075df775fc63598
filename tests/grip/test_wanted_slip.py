"""The controller does not stop intended slip, but it stops a fall."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from lsds_plugins.jobs.slide import SlideJob, SlideOptions

from lsds.cli.main import main
from lsds.contracts import ABSTAINED, Setting, Slide
from lsds.contracts.task import TaskOptions
from lsds.errors import ConfigError
from lsds.grip.wanted_slip import WantedSlip
from lsds.session.run import run
from tests.grip.test_belief_control import Grip

SLOWLY = Slide(0.01)
SEEN = replace(
    ABSTAINED, abstained=False, speed_m_s=0.01, speed_std_m_s=0.002, angular_rad_s=0.0, angular_std_rad_s=0.1
)


def falls(*estimates, slide=SLOWLY):
    wanted = WantedSlip()
    return [wanted.falls(40_000_000 * at, estimate, slide) for at, estimate in enumerate(estimates)]


def test_an_intended_slide_is_not_a_fall():
    assert not any(falls(*[SEEN] * 10, *[replace(SEEN, speed_m_s=0.03)] * 10))


def test_a_faster_slide_over_two_frames_is_a_fall():
    fast = replace(SEEN, speed_m_s=0.06)
    assert falls(SEEN, fast, SEEN, fast, fast) == [False, False, False, False, True]
    assert falls(*[replace(SEEN, angular_rad_s=3.0)] * 2, slide=Slide(0.0, 0.5)) == [False, True]
    assert not any(falls(*[replace(SEEN, angular_rad_s=1.5)] * 4, slide=Slide(0.0, 0.5)))


def test_an_uncertain_or_missing_estimate_is_not_a_fall():
    assert not any(falls(*[replace(SEEN, speed_m_s=0.06, speed_std_m_s=0.03)] * 5))
    assert not any(falls(*[replace(ABSTAINED, speed_m_s=1.0, speed_std_m_s=0.0)] * 5))


def test_the_controller_neither_closes_nor_opens_while_it_slides_as_wanted():
    grip = Grip(1.0)
    grip.quiet(0.4, 1.0)
    assert grip.frame(0.8, slip=True, speed=0.01, slide=SLOWLY) == 1.0
    assert [grip.frame(0.8, slip=True, speed=0.01, slide=SLOWLY) for _ in range(20)][-1] == 1.0
    assert [grip.frame(0.1, slip=False, slide=SLOWLY) for _ in range(20)][-1] == 1.0
    assert [grip.frame(0.8, slip=True, speed=0.08, slide=SLOWLY) for _ in range(3)][-1] > 1.2


@pytest.mark.parametrize("backend", ["belief", "pd"])
@pytest.mark.parametrize(("speed_m_s", "rate_rad_s"), [(-0.01, 0.0), (0.0, 0.5)])
def test_a_pipe_slides_and_turns_at_the_wanted_rate(backend, speed_m_s, rate_rad_s, installed_host):
    config = [
        "cell.simulated.fidelity=winkler",
        f"cell.simulated.clamped={'true' if rate_rad_s else 'false'}",
        f"controller.backend={backend}",
        "job.backend=slide",
        f"job.slide.speed_m_s={speed_m_s}",
        f"job.slide.turn_rad_s={rate_rad_s}",
        "job.slide.slide_s=1.0",
        "job.slide.hold_s=0.1",
    ]
    sliding = []
    session = run(None, config, observe=lambda c: sliding.append(c.t_ns) if c.stage == "slide" else None)
    assert session.fault is None
    truths = [t for t in session.truths if sliding[0] + 400_000_000 < t.t_ns < sliding[-1]]
    wanted = abs(rate_rad_s or speed_m_s)
    rates = [abs(t.slip_angular_rad_s) if rate_rad_s else math.hypot(*t.relative_velocity_m_s) for t in truths]
    assert math.sqrt(sum((rate / wanted - 1) ** 2 for rate in rates) / len(rates)) < 0.25
    forces = [t.normal_force_n for t in truths]
    assert max(forces) < 1.3 * forces[0]


def test_without_an_arm_nothing_slides():
    with pytest.raises(ConfigError, match=r"arm\.backend"):
        SlideJob(SlideOptions()).begin(Setting(0, TaskOptions()))


def test_the_study_reports_the_error_of_the_rate(tmp_path, installed_host, capsys):
    summary = tmp_path / "slide.json"
    command = ["study", "slide", "--object", "pvc-pipe", "--rate", "0.5", "--jobs", "1", "--json", str(summary)]
    assert main(command) == 0
    runs = json.loads(summary.read_text())["runs"]
    assert [run["rms"] < 0.25 for run in runs] == [True, True]
    assert main(["study", "slide", "--object", "unicorn"]) != 0
    assert "pvc-pipe" in "".join(capsys.readouterr())


def test_a_fall_closes_step_by_step():
    """It closed fully within four frames, before the first step could arrive: the load of the slide is a plateau."""
    grip = Grip(3.0)
    grip.deaf = True
    slide = Slide(0.01, 0.0)
    for _ in range(25):
        grip.frame(0.42, slip=True, speed=0.01, slide=slide)
    sent_mm = [grip.frame(0.42, slip=True, speed=0.2, slide=slide) for _ in range(8)]
    assert 3.0 < max(sent_mm) <= 6.0
