"""README and docs do what they say: their commands run, their configs load, their Python works."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from lsds.config import check_config
from lsds.registry import PluginHost

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"(?:<!-- (?P<note>[^>]*) -->\n)?```(?P<language>\w+)\n(?P<text>.*?)```", re.DOTALL)


def blocks(page: Path, language: str):
    for match in BLOCK.finditer(page.read_text(encoding="utf-8")):
        if match["language"] == language:
            yield match["note"] or "", match["text"]


def lsds_commands(page: Path):
    for _, text in blocks(page, "sh"):
        for line in text.splitlines():
            command = line.split("#")[0].strip()
            if command.startswith("lsds "):
                yield command


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with what the snippets name: a config, a recording."""
    import numpy as np

    from tests.tactile.render import pad_positions, render
    from tests.video_files import write_video

    (tmp_path / "recordings").mkdir()
    dots = pad_positions()
    frames = [render(dots + np.array([0.4 * i, 0.0]), seed=i) for i in range(6)]
    write_video(tmp_path / "clip.avi", frames)
    write_video(tmp_path / "recordings" / "one.avi", frames)
    (tmp_path / "rig.toml").write_text(next(text for _, text in blocks(ROOT / "README.md", "toml")), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


STUDIES_IN_SHORT = {
    "gel": "--scene sphere --random 0 --repeats 1",
    "optics": "--scene sphere --repeats 1",
    "frame": "--help",
    "scheduler": "--repeats 1",
}
"""Flags that make a study quick. These tests check only that it runs; the tests of each study check its results."""


def in_short(command):
    """Return the command, with flags that shorten a long study."""
    if re.match(r"lsds study (grip|faults|risk|slip|incipient-slip|models|choose|search|stability)(\s|$)", command):
        # Campaigns of minutes, which have separate tests.
        return f"{command} --help"
    found = re.fullmatch(r"lsds study (\w+)", command)
    return f"{command} {STUDIES_IN_SHORT.get(found[1], '')}" if found else command


@pytest.mark.parametrize("command", [c for page in PAGES for c in lsds_commands(page)])
def test_every_lsds_command_in_the_docs_runs(command, folder):
    bin_folder = str(Path(sys.executable).parent)
    environment = {**os.environ, "PATH": bin_folder + os.pathsep + os.environ["PATH"]}
    done = subprocess.run(in_short(command), shell=True, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_config_in_the_docs_loads():
    checked = 0
    for page in PAGES:
        for _, text in blocks(page, "toml"):
            data = tomllib.loads(text)
            if "project" in data or data.get("detector", {}).get("backend") == "acme-area":
                continue
            check_config(data, page.name, PluginHost())
            checked += 1
    assert checked >= 1


def test_the_plugin_page_makes_a_working_plugin(tmp_path, monkeypatch):
    page = ROOT / "docs" / "plugins.md"
    written = 0
    for note, text in blocks(page, "python"):
        if note.startswith("file: "):
            file = tmp_path / note.removeprefix("file: ")
            file.parent.mkdir(exist_ok=True)
            file.write_text(text, encoding="utf-8")
            written += 1
    assert written == 3
    monkeypatch.syspath_prepend(str(tmp_path))
    import acme_lsds.manifest

    host = PluginHost()
    host.register(acme_lsds.manifest, distribution="acme")
    config = next(text for _, text in blocks(page, "toml") if "shrink_per_s" in text)
    loaded = check_config(tomllib.loads(config), "docs", host)
    assert loaded.detector.backend == "acme-area"

    from lsds.clock import VirtualClock
    from lsds.contracts import BuildContext

    detector = host.build("detector", "acme-area", loaded.detector.options(), BuildContext(VirtualClock()))
    assert type(detector).__name__ == "AreaDetector"


@pytest.mark.usefixtures("installed_host")
def test_the_plugin_page_joins_the_simulated_cell(capsys):
    (text,) = [text for note, text in blocks(ROOT / "docs" / "plugins.md", "python") if note == "run: joining"]
    exec(compile(text, "plugins.md", "exec"), {"__name__": "snippet"})
    aperture, force = re.fullmatch(r"([\d.]+) mm, ([\d.]+) N\n", capsys.readouterr().out).groups()
    assert float(aperture) < 25
    assert float(force) > 3


def test_the_architecture_page_names_files_that_exist():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    files = set(re.findall(r"`(lsds/[\w/]+\.py)`", text))
    assert len(files) >= 8
    assert [file for file in sorted(files) if not (ROOT / file).exists()] == []


def test_the_picture_of_the_house_has_no_arrow_that_points_up():
    house = runpy.run_path(str(ROOT / "docs" / "house.py"))
    counted = house["arrows"]()
    assert len(counted) > 40
    assert house["upward"](counted) == []
    rooms = {room.removeprefix("lsds.") for room in house["ROOMS"]}
    shown = {path.stem for path in (ROOT / "lsds").glob("*") if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert shown - rooms - {"__init__", "__main__"} == set(), "a new room: put it on a floor in docs/house.py"


def test_every_file_named_in_the_docs_exists():
    missing = set()
    for page in PAGES:
        for name in re.findall(r"`((?:docs|lsds|tests|\.ci)/[\w./-]+)`", page.read_text(encoding="utf-8")):
            missing |= set() if (ROOT / name).exists() else {name}
        for name in re.findall(r"\]\((docs/[\w./-]+)\)", page.read_text(encoding="utf-8")):
            missing |= set() if (ROOT / name).exists() else {name}
    assert missing == set()


def test_ci_runs_the_readme_s_own_test_command():
    noted = [text.strip() for note, text in blocks(ROOT / "README.md", "sh") if note == "test command"]
    assert len(noted) == 1
    assert "pytest" in noted[0]
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "README.md" in script
    assert "pytest" not in script


@pytest.mark.parametrize("rig", sorted((ROOT / "examples" / "rigs").glob("*.toml")), ids=lambda rig: rig.name)
def test_every_example_rig_loads(rig):
    check_config(tomllib.loads(rig.read_text(encoding="utf-8")), rig.name, PluginHost())


@pytest.mark.usefixtures("installed_host")
def test_readme_and_the_page_about_the_library_show_code_that_works(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    pages = (ROOT / "docs" / "library.md", ROOT / "README.md")
    snippets = [(page.name, text) for page in pages for _, text in blocks(page, "python")]
    assert len(snippets) == 7
    for page, text in snippets:
        exec(compile(text, page, "exec"), {"__name__": "snippet"})


def test_the_page_about_the_wire_shows_code_that_works(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    snippets = [text for _, text in blocks(ROOT / "docs" / "wire.md", "python")]
    assert snippets
    for text in snippets:
        exec(compile(text, "wire.md", "exec"), {})


@pytest.mark.usefixtures("installed_host")
def test_the_page_about_grippers_shows_code_that_works(monkeypatch, tmp_path):
    pytest.importorskip("pymodbus", reason="pymodbus is not installed; it comes with the extra 'robotiq'")
    monkeypatch.chdir(tmp_path)
    snippets = [text for _, text in blocks(ROOT / "docs" / "swap_a_gripper.md", "python")]
    assert len(snippets) == 2
    for text in snippets:
        exec(compile(text, "swap_a_gripper.md", "exec"), {"__name__": "snippet"})


@pytest.mark.usefixtures("installed_host")
def test_the_page_about_tests_shows_tests_that_pass(tmp_path):
    pytest.importorskip("pymodbus", reason="pymodbus is not installed; it comes with the extra 'robotiq'")
    snippets = list(blocks(ROOT / "docs" / "test_without_hardware.md", "python"))
    for note, text in snippets:
        assert note.startswith("file: test_")
        (tmp_path / note.removeprefix("file: ")).write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    if "lsds" not in {entry.name for entry in entry_points(group="pytest11")}:
        command += ["-p", "lsds.testing.pytest_plugin"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(snippets) == 4


def test_decisions_name_files_that_exist():
    named = re.compile(r"`((?:lsds|plugins|drivers|mocks|tests|docs|examples)/[\w/.-]+\.(?:py|md|toml))`")
    missing = [
        f"{page.name}: {path}"
        for page in sorted((ROOT / "docs" / "decisions").glob("*.md"))
        for path in named.findall(page.read_text(encoding="utf-8"))
        if not (ROOT / path).exists()
    ]
    assert missing == []
