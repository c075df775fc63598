"""Helper processes do not import modules from the current folder."""

from __future__ import annotations

import math

import pytest
from lsds_drivers.ur.child import Child
from lsds_mocks.mock_process import MockProcess

from lsds.support.processes import spread
from tests.wire.ur.arms import Primary, fresh_host

SHADOWED = ("struct", "signal", "typing", "re", "dataclasses", "random", "json", "marshal", "numpy", "queue")


@pytest.fixture
def ran(tmp_path, monkeypatch):
    """Run in a folder of modules that shadow others; return a call that lists those that were imported."""
    record = tmp_path / "imported.txt"
    for name in SHADOWED:
        (tmp_path / f"{name}.py").write_text(f"with open({str(record)!r}, 'a') as file:\n    file.write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    return lambda: record.read_text() if record.exists() else ""


def test_the_arm_mock_and_its_compiler(ran):
    with MockProcess("ur5e", {"host": fresh_host()}) as arm, Primary(arm.addresses["primary"].split(":")[0]) as primary:
        primary.send('def p():\n  textmsg("compiled")\nend\n')
        assert primary.message(0) == b"compiled"
    assert ran() == ""


def test_the_plant(ran, tmp_path):
    with MockProcess("plant", {"socket": str(tmp_path / "p.sock"), "fidelity": "winkler"}) as plant:
        assert plant.alive
    assert ran() == ""


def test_parallel_workers(ran):
    assert dict(spread(math.sqrt, [4.0, 9.0, 16.0], 2)) == {4.0: 2.0, 9.0: 3.0, 16.0: 4.0}
    assert ran() == ""


def test_the_process_of_the_arm_driver(ran):
    child = Child("ur", {"host": "127.0.0.1"})
    child.close()
    assert ran() == ""
