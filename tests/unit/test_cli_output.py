from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from lsds.cli.output import plain, to_json, write_json
from lsds.cli.text_table import table
from lsds.errors import DataError
from lsds.safety.guard import SafetyOptions


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True)
class Row:
    b: float
    a: object


def test_plain_values():
    value = {
        "row": Row(math.nan, np.array([[1.0, np.inf]])),
        Colour.RED: Colour.RED,
        "scalar": np.float64(2.5),
        "whole": np.int32(3),
        "yes": np.bool_(True),
        "path": Path("x/y"),
        "set": {2, 1},
        "tuple": (None, True, "s"),
        "options": SafetyOptions(),
    }
    data = json.loads(to_json(value))
    assert data["row"] == {"a": [[1.0, None]], "b": None}
    assert data["red"] == "red"
    assert (data["scalar"], data["whole"], data["yes"]) == (2.5, 3, True)
    assert (data["path"], data["set"], data["tuple"]) == ("x/y", [1, 2], [None, True, "s"])
    assert data["options"]["max_aperture_m"] is None


def test_the_text_is_stable_and_strict():
    assert to_json({"b": 1, "a": -math.inf}) == '{\n  "a": null,\n  "b": 1\n}\n'
    with pytest.raises(TypeError, match="cannot write a object"):
        plain(object())


def test_writing_replaces_the_file_at_once(tmp_path):
    target = tmp_path / "x.json"
    target.write_text("old")
    write_json({"a": 1}, target)
    assert json.loads(target.read_text()) == {"a": 1}
    assert os.listdir(tmp_path) == ["x.json"]
    assert target.stat().st_mode & 0o777 == 0o666 & ~_umask()


def test_a_failed_write_leaves_the_old_file_and_no_rubbish(tmp_path, monkeypatch):
    target = tmp_path / "x.json"
    target.write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(DataError, match=r"x\.json: cannot be written: No space left"):
        write_json({}, target)
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["x.json"]


def test_stdout_and_special_files(capsys):
    write_json([1], "-")
    assert json.loads(capsys.readouterr().out) == [1]
    write_json([1], "/dev/null")
    with pytest.raises(DataError):
        write_json([1], "/")


def test_table():
    assert table([("a", "bcd"), ("ef", "")], ("X", "Y")) == "X   Y\n--  ---\na   bcd\nef"


def _umask():
    current = os.umask(0)
    os.umask(current)
    return current
