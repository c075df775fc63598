"""Without the libraries of an extra, every command and study says in one line what to install."""

from __future__ import annotations

import sys

import pytest
from research.synthetic import dataset

from lsds.cli.main import main
from lsds.registry import PluginHost

HOST = PluginHost()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dataset("abcd").save(tmp_path / "data")
    return tmp_path


def refused(capsys, arguments, extra):
    """Run a command; it says one line that names the extra, and nothing was begun."""
    assert main(arguments) == 3
    errors = [line for line in capsys.readouterr().err.splitlines() if not line.startswith(("measuring", "collecting"))]
    assert len(errors) == 1
    assert errors[0].startswith("error: ")
    assert errors[0].endswith(f"pip install 'lsds-tactile[{extra}]'")


@pytest.mark.parametrize(
    ("library", "command", "extra"),
    [
        ("pyarrow", "learn collect pipe --out out", "data"),
        ("pyarrow", "learn train logistic --data data --out m.onnx", "train"),
        ("sklearn", "learn train logistic --data data --out m.onnx", "train"),
        ("torch", "learn train field-mlp --data data --out m.onnx", "train"),
        ("torch", "study reproduce --quick --out out", "train"),
        ("matplotlib", "study reproduce --quick --out out", "plot"),
        ("sklearn", "study incipient-slip data", "train"),
        ("numba", "study frame", "sim"),
        ("numba", "study gel", "sim"),
        ("numba", "study optics", "sim"),
        ("numba", "study detectors --data data", "sim"),
        ("torch", "study detectors --data data", "train"),
        ("torch", "study estimators --data data", "train"),
        ("sklearn", "study learning --data data", "train"),
        ("pyarrow", "study models data", "data"),
        ("pyarrow", "study incipient-slip data", "train"),
        ("pyarrow", "study slip data", "data"),
        ("sklearn", "learn train fused --labelled data --out m.onnx", "train"),
    ],
)
def test_it_is_one_line_with_the_remedy_before_anything_is_done(folder, monkeypatch, capsys, library, command, extra):
    monkeypatch.setitem(sys.modules, library, None)
    refused(capsys, command.split(), extra)
    assert [path.name for path in folder.iterdir()] == ["data"]


def test_help_needs_none_of_them(monkeypatch, capsys):
    for name in ("numba", "matplotlib", "pyarrow", "sklearn", "torch", "onnx"):
        monkeypatch.setitem(sys.modules, name, None)
    for name in HOST.names("study"):
        assert main(["study", name, "--help"]) == 0
    for backend in (each for each in HOST.backends if each.spec.kind == "command"):
        assert main([*filter(None, [backend.spec.group]), backend.spec.name, "--help"]) == 0
    assert "Examples:" in capsys.readouterr().out


def test_without_matplotlib_only_the_picture_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    quick = ["study", "gel", "--scene", "sphere", "--random", "0", "--repeats", "1"]
    assert main(quick) == 0
    shown = capsys.readouterr()
    assert "winkler" in shown.out
    assert "no picture: a picture needs matplotlib" in shown.err
    assert main([*quick, "--plot", "d.png", "--csv", "d.csv"]) == 3
    assert "pip install 'lsds-tactile[plot]'" in capsys.readouterr().err
    assert (tmp_path / "d.csv").exists()
