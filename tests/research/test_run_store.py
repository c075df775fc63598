"""Stored runs survive interruptions, and a file of another kind is refused and left as it is."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research import run_store
from lsds_research.run_store import add_run, read_runs

from lsds.errors import DataError


def test_a_study_may_be_interrupted_again_and_again(tmp_path):
    """The second interruption lost everything: the first cut line was no longer the last one."""
    file = tmp_path / "runs.jsonl"
    for k in range(4):
        add_run(file, f"run {k}", {"value": k})
        with file.open("ab") as interrupted:
            interrupted.write(b'{"key": "cut", "run": {"va')
        assert read_runs(file) == {f"run {n}": {"value": n} for n in range(k + 1)}


@given(cut=st.integers(0, 60), values=st.lists(st.integers(), min_size=1, max_size=3))
def test_wherever_a_write_was_cut_the_whole_lines_are_kept(cut, values, tmp_path_factory):
    file = tmp_path_factory.mktemp("store") / "runs.jsonl"
    for k, value in enumerate(values):
        add_run(file, f"run {k}", {"value": value})
    whole = file.read_bytes()
    file.write_bytes(whole[: max(0, len(whole) - cut)])
    kept = read_runs(file)
    assert kept == {f"run {k}": {"value": value} for k, value in enumerate(values[: len(kept)])}
    add_run(file, "last", {"value": 0})
    assert read_runs(file) == kept | {"last": {"value": 0}}


NO_STORES = [b"my notes", b"my notes\n", b"\xff\xfe\x00", b'{"key": 1}\n', b'{"name": "a"}']
NO_RUNS = [b'{"key": "a", "run": 5}\n', b'{"key": "a", "run": {}}\n', b'{"key": 1, "run": {"value": 1}}\n']


@pytest.mark.parametrize("content", NO_STORES + NO_RUNS)
def test_a_file_that_is_no_store_is_refused(content, tmp_path):
    file = tmp_path / "notes.txt"
    file.write_bytes(content)
    with pytest.raises(DataError, match="choose another file"):
        read_runs(file)
    assert file.read_bytes() == content


def test_a_folder_is_refused(tmp_path):
    with pytest.raises(DataError, match="choose another file"):
        read_runs(tmp_path)


def test_runs_by_another_version_of_the_code_are_reported(tmp_path, monkeypatch):
    file = tmp_path / "runs.jsonl"
    add_run(file, "a", {"value": 1})
    monkeypatch.setattr(run_store, "code_digest", lambda: "another")
    add_run(file, "b", {"value": 2})
    with pytest.warns(UserWarning, match="1 of 2 runs were stored by another version of the code"):
        assert set(read_runs(file)) == {"a", "b"}
