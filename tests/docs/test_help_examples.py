"""The examples in the help texts are valid commands, and those that take seconds have their stated outcome."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from lsds.cli.main import cli, main
from lsds.config import load_config
from tests.docs.command_tree import commands

ROOT = Path(__file__).parents[2]
EXAMPLE = re.compile(r"^(lsds \S.*?)(?:\s{2,}(\S.*))?$")


def examples():
    """Return the examples of all help texts, each with the result stated next to it or below."""
    found = {}
    for _, command in commands(cli, ("lsds",)):
        last = ""
        # A backslash at the end of a line continues the example on the next one, as in a shell.
        text = re.sub(r" \\\n\s*", " ", (command.help or "").partition("Examples:")[2])
        for line in text.splitlines():
            match = EXAMPLE.match(line.strip())
            if match:
                last = match[1]
                found.setdefault(last, match[2] or "")
            elif last and line.strip():
                found[last] = f"{found[last]} {line.strip()}".strip()
    return found


EXAMPLES = examples()
STATED_CODE = re.compile(r"\((?:exit code )?(\d+)\)")
SECONDS = (
    r"lsds run( |$)(?!failures|rig.toml --set 'cal|--set detector.backend=onnx)",
    r"lsds track ",
    r"lsds (plugins|schema|devices|completion|new)\b",
    r"lsds study$",
    r"lsds study gel --help",
    r"lsds calibrate camera --board",
    r"lsds calibrate grip$",
    r"lsds learn label recordings/\*\.avi --pictures",
)
"""Examples that are executed as they stand. The others run for minutes, serve until they are stopped, open a window, or
need hardware or a data set: their arguments are checked."""


def arguments_of(example):
    """Return the words after `lsds`; what is written to a file by the shell is not."""
    words = shlex.split(example.partition(" >")[0], comments=True)[1:]
    return [path for word in words for path in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the files that the examples name."""
    import cv2
    import numpy as np

    from tests.tactile.render import pad_positions, render
    from tests.video_files import write_video

    folder = tmp_path_factory.mktemp("examples")
    dots = pad_positions()
    frames = [render(dots + np.array([0.4 * i, 0.0]), seed=i) for i in range(6)]
    for name in ("clip.avi", "clip.mp4", "recordings/mug.avi", "s.avi", "w1.avi", "w2.avi", "p.avi", "board.mp4"):
        (folder / name).parent.mkdir(exist_ok=True)
        write_video(folder / name, frames)
    (folder / "frames").mkdir()
    for number, frame in enumerate(frames):
        cv2.imwrite(str(folder / "frames" / f"{number:03}.png"), frame)
    for name in ("views", "videos", "new-objects", "detection", "severity", "reproduction", "contact_reference"):
        (folder / name).mkdir()
    cv2.imwrite(str(folder / "views" / "0.png"), frames[0])
    (folder / "rig.toml").write_text('[gripper]\nbackend = "mock-hand-e"\n')
    (folder / "second.csv").write_text("video,first,last,state,tx_px,ty_px,turn_deg,confidence,labeller,note\n")
    (folder / "ranges.toml").write_text("")
    (folder / "loop.jsonl").write_text("")
    (folder / "failures").mkdir()
    (folder / "failures" / "holds-1.toml").write_text("")
    (folder / "examples").symlink_to(ROOT / "examples")
    return folder


@pytest.fixture
def folder(files, monkeypatch):
    monkeypatch.chdir(files)
    return files


def is_short(example):
    return any(re.match(pattern, example) for pattern in SECONDS)


def test_there_are_examples_of_both_kinds():
    assert len(EXAMPLES) > 120
    assert sum(map(is_short, EXAMPLES)) > 25


@pytest.mark.usefixtures("installed_host")
@pytest.mark.parametrize("example", [example for example in EXAMPLES if is_short(example)])
def test_an_example_of_seconds_has_its_stated_outcome(example, folder, capsys):
    stated = STATED_CODE.search(EXAMPLES[example])
    code = main(arguments_of(example))
    printed = capsys.readouterr()
    assert code == (int(stated[1]) if stated else 0), printed.out + printed.err
    if code == 8:
        assert "dropped" in EXAMPLES[example]
        assert "dropped (simulated)" in printed.out


@pytest.mark.usefixtures("installed_host")
@pytest.mark.parametrize("example", [example for example in EXAMPLES if not is_short(example)])
def test_the_arguments_of_a_long_example_are_valid(example, folder, monkeypatch):
    given = {}

    def note(self, context):
        given.update(context.params)

    # Groups look their commands up as ever; only the last command is not carried out.
    real = click.Command.invoke
    monkeypatch.setattr(
        click.Command, "invoke", lambda self, ctx: real(self, ctx) if isinstance(self, click.Group) else note(self, ctx)
    )
    assert main(arguments_of(example)) == 0
    if example.startswith("lsds run"):
        load_config(given["config"], [text for text in given["overrides"] if not text.startswith("calibration")])


def test_a_wrong_example_is_found(folder):
    assert main(["study", "grip", "--objct", "ball"]) == 2
