"""Study `certify` around a lift that is planted: what counts as a drop, and what is checked before the first lift."""

from __future__ import annotations

import pytest
from lsds_research.certify.options import CertifyOptions
from lsds_research.certify.study import CertifyStudy
from lsds_research.search import scenarios
from pydantic import ValidationError

from lsds.clock import WallClock
from lsds.contracts import BuildContext
from lsds.errors import ConfigError, DataError

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install '.[search]'")
NOT_BEGUN = {"margins": {"named": 0.1}, "outcome": "not run", "fault": "no such object"}
HELD = {"outcome": "held", "sentence": "held", "fault": None, "slip_m": 1e-4, "ratio": 1.5, "delay_s": None}


@pytest.fixture
def planted(monkeypatch):
    """Return a function that certifies with given results of a lift, by a count of lifts."""
    asked = []

    def certify(result, **options):
        def lift(scenario):
            asked.append(scenario[0])
            certify.settings.append(scenario[2])
            return result(len(asked) - 1)

        monkeypatch.setattr(scenarios, "run_scenario", lift)
        study = CertifyStudy(CertifyOptions(runs=16, jobs=1, **options), BuildContext(WallClock(), 0))
        return study.run(lambda *_: None)

    certify.asked, certify.settings = asked, []
    return certify


def test_a_crushed_object_that_is_held_is_no_drop_anywhere(planted, tmp_path):
    crushed = HELD | {"margins": {"holds": 1.0, "does not crush": -1.0}}
    result = planted(lambda _: crushed, found=str(tmp_path))
    assert result.details["probability"]["failed"] == 0
    assert {row["margin"] for row in result.details["runs"]} == {1.0}
    assert result.details["files"] == []


def test_the_worst_drop_is_saved_first(planted, tmp_path):
    margins = [
        {"slips little": -0.9, "does not crush": 0.5},
        {"slips little": -0.1, "does not crush": -1.0},
        {"slips little": 0.5, "does not crush": -1.0},
    ]
    planted(lambda count: HELD | {"margins": margins[min(count, 2)]}, found=str(tmp_path), most=1)
    (file,) = tmp_path.iterdir()
    assert f"seed = {planted.asked[0]['seed']}\n" in file.read_text()


def test_lifts_that_could_not_run_are_reported(planted):
    result = planted(lambda count: NOT_BEGUN if count < 1 else HELD | {"margins": {"holds": 1.0}})
    assert any("1 of 16 scenarios could not run" in text and "no such object" in text for text in result.warnings)


def test_a_certificate_of_lifts_of_which_many_could_not_run_is_an_error(planted):
    with pytest.raises(DataError, match=r"3 of 16 scenarios could not run.* no such object .narrow the range"):
        planted(lambda count: NOT_BEGUN if count < 3 else HELD | {"margins": {"holds": 1.0}})


def test_ends_of_ranges_that_cannot_run_are_found_before_the_first_lift(planted, tmp_path):
    space = tmp_path / "space.toml"
    space.write_text('"cell.simulated.mass_kg" = [-5.0, 10.0]\n"task.hold_s" = [0.3, 0.4]\n')
    with pytest.raises(ConfigError, match=r"space.toml with the settings: 1 problem\n.*mass_kg"):
        planted(lambda _: HELD, space=str(space))
    assert planted.asked == []


@pytest.mark.parametrize(
    ("own", "rig", "limit_m"),
    [(None, "", 0.06), (None, "max_slip_m = 0.004", 0.004), (30.0, "max_slip_m = 0.004", 0.03)],
)
def test_the_slip_limit_is_the_one_given_or_that_of_the_rig(planted, tmp_path, own, rig, limit_m):
    file = tmp_path / "rig.toml"
    file.write_text(f"[task]\n{rig}\n")
    given = {} if own is None else {"slip_mm": own}
    result = planted(lambda _: HELD | {"margins": {"holds": 1.0}}, rig=str(file), **given)
    assert result.details["slip_limit_m"] == pytest.approx(limit_m)


def test_a_folder_that_cannot_be_written_to_is_found_before_the_first_lift(planted, tmp_path):
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(DataError, match=r"cannot be written.*choose another folder"):
        planted(lambda _: HELD | {"margins": {"holds": 1.0}}, found=str(file))
    assert planted.asked == []


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("[sensors.left]\n[sensors.right.mock-gelsight-mini]\nfinger = 'right'\n", "2 fingertips: the first of them"),
        ("[arm]\nbackend = 'none'\n", "arm 'none': mock-ur5e, because a lift needs one"),
    ],
)
def test_a_rig_of_two_fingers_or_without_an_arm_can_be_certified(planted, tmp_path, text, note):
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    result = planted(lambda _: HELD | {"margins": {"holds": 1.0}}, rig=str(rig))
    assert any(note in each for each in result.notes)


def test_a_config_that_is_wrong_is_found_before_the_first_lift(planted):
    with pytest.raises(ConfigError, match="lift_sped_m_s"):
        planted(lambda _: HELD, settings=["task.lift_sped_m_s=1"])
    assert planted.asked == []


def test_own_ranges_are_run_as_they_are_written(planted, tmp_path):
    space = tmp_path / "space.toml"
    space.write_text(
        '"cell.simulated.shape" = ["sphere", "box"]\n"task.lift_speed_m_s" = [0.02, 0.08]\n"task.lift_s" = [0.2, 0.5]\n'
    )
    planted(lambda _: HELD | {"margins": {"holds": 1.0}}, space=str(space))
    assert all(0.2 <= scenario["task.lift_s"] <= 0.5 for scenario in planted.asked)


def test_keys_of_the_rig_are_not_drawn_and_a_stated_limit_counts_above_its_own(planted, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text("seed = 3\n[task]\nlift_speed_m_s = 0.02\nmax_slip_m = 0.05\n")
    result = planted(lambda _: HELD | {"margins": {"holds": 1.0}}, rig=str(rig), slip_mm=20)
    assert {(scenario["seed"], scenario["task.lift_speed_m_s"]) for scenario in planted.asked} == {(3, 0.02)}
    assert any("hold them fixed" in note and "task.lift_speed_m_s" in note for note in result.notes)
    assert not any("max_slip_m" in text for text in planted.settings[0])


def test_a_slip_that_was_never_noticed_has_no_alarm(planted):
    lost = HELD | {"margins": {"holds": -1.0}, "slip_m": 0.06}
    alarmed = HELD | {"margins": {"holds": 1.0}, "slip_m": 2e-3, "delay_s": 0.04}
    result = planted(lambda count: alarmed if count < 1 else lost)
    (row,) = [row for row in result.rows if "alarm" in row["figure"]]
    assert (row["value"], row["range"]) == ("none", "none in more than 5 % of them")


def test_an_interrupted_number_of_lifts_continues_from_its_file(planted, tmp_path):
    kept = str(tmp_path / "lifts.jsonl")

    def interrupted(count):
        if count == 11:
            raise KeyboardInterrupt
        return HELD | {"margins": {"holds": 1.0}}

    with pytest.raises(KeyboardInterrupt):
        planted(interrupted, out=kept)
    result = planted(lambda _: HELD | {"margins": {"holds": 1.0}}, out=kept)
    assert result.details["probability"]["runs"] == 16
    assert len(planted.asked) == 12 + 5
    with pytest.raises(ValidationError, match="out needs runs"):
        CertifyOptions(out=kept)


def test_another_job_of_a_rig_is_replaced_by_a_lift(planted, tmp_path):
    """Each release on purpose was a drop, so the probability was 100 %."""
    rig = tmp_path / "rig.toml"
    rig.write_text('[job]\nbackend = "hold"\n[job.hold]\nduration_s = 1.0\n')
    result = planted(lambda _: HELD | {"margins": {"holds": 1.0}}, rig=str(rig))
    assert any("job 'hold': lift, because a certificate counts lifts" in note for note in result.notes)
    assert any(text.startswith("job.backend=") and "lift" in text for text in planted.settings[0])


@pytest.mark.parametrize(
    ("drops", "note"),
    [
        (16, "every lift dropped"),
        (13, "the budget is too small"),
        (3, "the budget is too small"),
        (0, "no lift dropped"),
    ],
)
def test_too_few_lifts_are_named_on_both_sides(planted, drops, note):
    margins = [-1.0] * drops + [1.0] * (16 - drops)
    result = planted(lambda count: HELD | {"margins": {"holds": margins[count]}})
    assert any(note in text for text in result.notes)


def test_an_error_that_nothing_raises_on_purpose_is_a_failure_and_not_left_out(planted):
    broken = {"margins": {"named": -1.0}, "outcome": "not run", "fault": "ZeroDivisionError: division by zero"}
    result = planted(lambda _: broken)
    assert result.details["probability"]["failed"] == 16
    (warning,) = result.warnings
    assert "16 of 16 scenarios ended with an unexpected error and count as failures; the first: ZeroDiv" in warning
    assert "ZeroDivisionError" in result.details["runs"][0]["fault"]


@pytest.mark.parametrize("budget", [f"1{400 * '0'}h", "0s", "1001h", "10"])
def test_a_budget_that_is_no_duration_is_named(budget):
    with pytest.raises(ValidationError, match="is no duration up to 1000h"):
        CertifyOptions(budget=budget)
