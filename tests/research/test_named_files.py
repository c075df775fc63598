"""A stored run counts only for the files that it was made with."""

from __future__ import annotations

import os

import pytest
from lsds_research.named_files import files_of_rig, files_of_settings
from lsds_research.run_store import read_runs
from lsds_research.search.robustness import Limits
from lsds_research.search.scenarios import Scenarios
from lsds_research.studies.faults.case import Case

from lsds.errors import DataError


@pytest.fixture(autouse=True)
def forget():
    for cached in (files_of_rig, files_of_settings):
        cached.cache_clear()
    yield
    for cached in (files_of_rig, files_of_settings):
        cached.cache_clear()


def written(path, margin):
    path.write_text(f"[controller.belief]\nmargin = {margin}\n", encoding="utf-8")
    files_of_rig.cache_clear()
    files_of_settings.cache_clear()
    return path


def test_another_calibration_of_the_same_name_is_another_scenario(tmp_path):
    settings = [f'calibration=["{written(tmp_path / "cal.toml", 1.08)}"]']

    def key():
        with Scenarios(Limits(), settings, "", 1, "") as scenarios:
            return scenarios._key({"seed": 1})

    before = key()
    assert key() == before
    written(tmp_path / "cal.toml", 3.0)
    assert key() != before


def test_settings_without_files_have_the_keys_that_they_had():
    assert files_of_settings(("controller.belief.margin=1.2", "cell.simulated.object=can")) == ""


def test_another_calibration_next_to_a_rig_is_another_case(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["cal.toml"]\n', encoding="utf-8")
    written(tmp_path / "cal.toml", 1.08)
    before = Case("belief", "fused", 1, rig=str(rig)).key
    written(tmp_path / "cal.toml", 3.0)
    assert Case("belief", "fused", 1, rig=str(rig)).key != before


def test_a_store_in_a_folder_that_does_not_exist_is_refused_before_the_runs(tmp_path):
    with pytest.raises(DataError, match="no such folder"):
        read_runs(tmp_path / "nowhere" / "runs.jsonl")
    assert read_runs(tmp_path / "runs.jsonl") == {}
    assert not os.listdir(tmp_path)
