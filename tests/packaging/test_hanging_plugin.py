"""`lsds run` with a third-party gripper that hangs: it is named, the results are written, and the process ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from tests.packaging.hanging import FILES

pytestmark = pytest.mark.skipif(os.name == "nt", reason="sends signals")
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=0.3", "task.hold_s=0.1", "task.settle_s=0.2")
LIMITS = ("deadlines.connect_s=1.0", "deadlines.arm_s=1.0", "deadlines.call_s=1.0", "deadlines.close_s=0.5")
TOO_LONG_S = 60
"""No limit of speed: beyond this, the process did not end."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def start(site, tmp_path):
    """Return a function that starts `lsds run` with that gripper in a separate process."""
    started = []

    def run(*overrides):
        chosen = ("gripper.backend=acme", *QUICK, *overrides)
        flags = [part for override in chosen for part in ("--set", override)]
        process = subprocess.Popen(
            [sys.executable, "-m", "lsds.cli.main", "run", "--no-plot", "--json", str(tmp_path / "run.json"), *flags],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *sys.path])},
        )
        started.append(process)
        return process

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("call", ["connect", "command", "close"])
def test_a_hang_is_named_and_ends_the_run(start, call, tmp_path):
    process = start(f"gripper.acme.hangs={call}", *LIMITS)
    out, err = process.communicate(timeout=TOO_LONG_S)
    assert process.returncode == 4, out + err
    what = "has not returned from" if call == "connect" else "gripper 'acme' has not returned from"
    assert f"{what} {call}() for" in err, out + err
    assert "deadlines." in err
    if call == "connect":
        return
    summary = json.loads((tmp_path / "run.json").read_text())
    assert summary["outcome"] == ("held" if call == "close" else "fault")
    assert "outcome" in out


@pytest.mark.parametrize(("leaves", "message"), [("thread", "thread 'acme-pump'"), ("process", "'acme-child'")])
def test_what_a_plugin_leaves_running_is_named_and_does_not_keep_the_process(start, leaves, message):
    process = start(f"gripper.acme.leaves={leaves}")
    out, err = process.communicate(timeout=TOO_LONG_S)
    assert process.returncode == 0, out + err
    assert "warning: a plugin's" in err
    assert message in err


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="needs /proc")
def test_a_program_that_a_plugin_leaves_running_is_named(start):
    process = start("gripper.acme.leaves=program")
    _, err = process.communicate(timeout=TOO_LONG_S)
    assert process.returncode == 0
    assert "warning: a plugin has left a process running" in err
    os.kill(int(err.split("running: ")[1].split()[0]), signal.SIGKILL)


@pytest.mark.parametrize(
    ("call", "number", "code"),
    [
        ("connect", signal.SIGINT, 130),
        ("read", signal.SIGINT, 130),
        ("read", signal.SIGTERM, 143),
        ("close", signal.SIGTERM, 143),
    ],
)
def test_one_signal_ends_it_in_every_phase(start, call, number, code, tmp_path):
    marker = tmp_path / "hangs"
    late = 200 if call == "read" else 1
    generous = ["deadlines.connect_s=600.0", "deadlines.call_s=600.0", "deadlines.close_s=600.0"]
    process = start(
        f"gripper.acme.hangs={call}", f"gripper.acme.from_call={late}", f"gripper.acme.marker={marker}", *generous
    )
    end = time.monotonic() + TOO_LONG_S
    while not marker.exists():
        assert time.monotonic() < end
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    process.send_signal(number)
    sent = time.monotonic()
    out, err = process.communicate(timeout=TOO_LONG_S)
    print(f"{call} {code}: ended after {time.monotonic() - sent:.2f} s")
    assert process.returncode == code, out + err
    assert "Traceback" not in err
    if call != "connect":
        summary = json.loads((tmp_path / "run.json").read_text())
        assert summary["outcome"] == ("stopped" if call == "read" else "held")
