"""Installed plugins are read once in a process, and again if a folder of the module search path has changed."""

from __future__ import annotations

import importlib
import os

import pytest

from lsds.registry import discovery
from lsds.registry.discovery import installed_entry_points


def install(folder, name, plugin):
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[lsds_test]\n{plugin} = json\n")
    # Clocks of file systems may be coarse.
    os.utime(folder, ns=(0, (folder.stat().st_mtime_ns + 10**9)))
    importlib.invalidate_caches()


def found():
    return {each.name: each.dist.name for each in installed_entry_points("lsds_test")}


def test_a_plugin_that_is_installed_while_the_process_runs_is_found(tmp_path, monkeypatch):
    assert found() == {}
    monkeypatch.syspath_prepend(str(tmp_path))
    install(tmp_path, "acme", "first")
    assert found() == {"first": "acme"}
    install(tmp_path, "other", "second")
    assert found() == {"first": "acme", "second": "other"}
    assert next(each for each in installed_entry_points("lsds_test") if each.name == "first").load().__name__ == "json"


def test_what_has_not_changed_is_not_read_again(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    install(tmp_path, "acme", "first")
    before = found()
    monkeypatch.setattr(discovery, "entry_points", lambda group: pytest.fail("read again"))
    assert found() == before


def test_a_damaged_distribution_is_no_answer_that_is_kept(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    install(tmp_path, "acme", "first")
    with monkeypatch.context() as damaged:
        damaged.setattr(discovery, "entry_points", lambda group: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            found()
    assert found() == {"first": "acme"}
