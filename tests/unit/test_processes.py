"""Work over processes: crashes stay where they happen, errors come out, nobody outlives the parent."""

import os
import signal
import subprocess
import sys
import time

import pytest

from lsds.processes import spread


def square(number):
    return number * number


def deadly(number):
    if number == 3:
        os._exit(1)
    return number * number


def wrong(number):
    if number == 2:
        raise ValueError("two is wrong")
    return number


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_item_comes_back_once(jobs):
    assert sorted(spread(square, range(7), jobs)) == [(k, k * k) for k in range(7)]


def test_a_crash_costs_its_own_item_only():
    found = dict(spread(deadly, range(6), 2))
    assert found == {k: None if k == 3 else k * k for k in range(6)}


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_work_raises_is_raised(jobs):
    with pytest.raises(ValueError, match="two is wrong"):
        list(spread(wrong, range(6), jobs))


SLEEPER = """
import sys, time
from lsds.processes import spread
def sleep(number):
    print(number, flush=True)
    time.sleep(1.0)
    return number
if __name__ == "__main__":
    list(spread(sleep, range(1000), 2))
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_nobody_goes_on_when_the_parent_is_interrupted_or_killed(tmp_path, how):
    script, told = tmp_path / "sleeper.py", tmp_path / "told.txt"
    script.write_text(SLEEPER)
    with told.open("w") as out, subprocess.Popen([sys.executable, script], stdout=out, stderr=subprocess.DEVNULL) as it:
        deadline = time.monotonic() + 60
        while len(told.read_text().split()) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        it.send_signal(how)
    begun = len(told.read_text().split())
    assert 2 <= begun < 100
    time.sleep(3.0)
    assert len(told.read_text().split()) <= begun + 2
