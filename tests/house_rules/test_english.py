"""Prose and names avoid the idioms that readers stumble over."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from tests.house_rules import english

pytestmark = pytest.mark.skipif(
    shutil.which("git") is None or not (english.ROOT / ".git").exists(), reason="needs the files that git tracks"
)


def test_no_file_has_an_idiom():
    places = [
        f"{name}:{place.line}: '{place.found}'; better: {place.better}"
        for name, found in english.tree().items()
        for place in found
    ]
    assert places == [], "rewrite the sentence, or rename"


@pytest.mark.parametrize(
    ("text", "idioms"),
    [
        ("# the brain answers", ["brain"]),
        ('"""Says what nobody described."""', ["nobody"]),
        ("def told_aperture(): ...", ["told_aperture"]),
        ("self.last_told = 1", ["last_told"]),
        ("x = observation.told", []),  # read from somewhere else: reported where it is defined
        ("raise Error('it tells one state for ever')", ["tells"]),
        ("# the driver reports the aperture", []),
        ("untold = 'besides'", []),
    ],
)
def test_idioms_are_found_in_prose_and_names(tmp_path, text, idioms):
    (file := tmp_path / "module.py").write_text(text, encoding="utf-8")
    assert [place.found for place in english.places(file)] == idioms


def test_subjects_of_new_commits_are_short():
    known = subprocess.run(["git", "cat-file", "-e", english.FIRST_CHECKED], cwd=english.ROOT, capture_output=True)
    if known.returncode:
        pytest.skip("the history does not reach back to the first commit that is checked")
    log = ["git", "log", "--no-merges", "--format=%s", f"{english.FIRST_CHECKED}..HEAD"]
    subjects = subprocess.run(log, cwd=english.ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    assert [subject for subject in subjects if len(subject) > english.MOST_SUBJECT] == []
