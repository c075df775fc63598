"""Parallel work: a crash affects only its item, errors are raised, workers end with their parent."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import pytest

from lsds.support import processes
from lsds.support.processes import COLLECT_EVERY, Workers, spread


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
def test_an_error_of_the_work_is_raised(jobs):
    with pytest.raises(ValueError, match="two is wrong"):
        list(spread(wrong, range(6), jobs))


def test_a_single_item_cannot_crash_the_caller():
    assert list(spread(deadly, [3], 2)) == [(3, None)]


def begun(item):
    folder, number = item
    (folder / str(number)).touch()
    return number


def test_work_goes_on_while_the_caller_handles_a_result(tmp_path):
    results = spread(begun, [(tmp_path, number) for number in range(5)], 2)
    next(results)
    until = time.monotonic() + 20
    while len(list(tmp_path.iterdir())) < 3 and time.monotonic() < until:
        time.sleep(0.01)
    assert len(list(tmp_path.iterdir())) >= 3
    assert len(list(results)) == 4


def pids(number):
    return os.getpid() if number != 2 else os._exit(1)


def test_workers_are_kept_from_part_to_part_and_end_with_the_statement():
    with Workers(2) as workers:
        first = {pid for _, pid in workers.spread(pids, [0, 1])}
        again = {pid for _, pid in workers.spread(pids, [3, 4, 5])}
        assert len(first | again) <= 2
        assert dict(workers.spread(pids, [2])) == {2: None}, "a crash ends the processes"
        after = {pid for _, pid in workers.spread(pids, [6, 7])}
        assert not after & (first | again)
    for pid in after:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


class Tied:
    """Something that only a collection frees."""

    alive = 0

    def __init__(self):
        self.itself = self
        Tied.alive += 1

    def __del__(self):
        Tied.alive -= 1


def left_over(number):
    Tied()
    return Tied.alive


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_refers_to_itself_does_not_pile_up(jobs):
    most = max(alive for _, alive in spread(left_over, range(4 * COLLECT_EVERY), jobs))
    assert most <= COLLECT_EVERY


def test_an_error_ends_the_workers_and_the_next_part_starts_new_ones():
    with Workers(2) as workers:
        with pytest.raises(ValueError, match="two is wrong"):
            list(workers.spread(wrong, range(6)))
        assert sorted(workers.spread(square, [4])) == [(4, 16)]


def test_after_a_crash_the_rest_is_done_together_again():
    found = dict(spread(pids, range(40), 2))
    assert found.pop(2) is None
    assert len(set(found.values())) < 10, "not a process an item"


def test_nothing_is_lost_where_a_crash_falls_between_a_result_and_what_follows_it(monkeypatch):
    """The pool is found broken only when the next item is submitted; earlier and later results are kept."""
    submit, calls = ProcessPoolExecutor.submit, []

    def breaks_once(self, *arguments):
        calls.append(arguments)
        if len(calls) == 5:
            raise BrokenProcessPool
        return submit(self, *arguments)

    monkeypatch.setattr(ProcessPoolExecutor, "submit", breaks_once)
    assert sorted(spread(square, range(8), 2)) == [(k, k * k) for k in range(8)]


SLEEPER = """
import os, sys, time
from lsds.support.processes import COLLECT_EVERY, Workers, spread
def sleep(number):
    print(os.getpid(), flush=True)
    time.sleep(0.5 if number else 0.0)
    return number
{guard}
    list(spread(sleep, range({count}), 2))
    print("left", flush=True)
"""
GUARD = 'if __name__ == "__main__":'


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="looks into /proc")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("count", [2, 1000])
def test_no_worker_outlives_a_parent_that_is_interrupted_or_killed(tmp_path, how, count):
    script, output = tmp_path / "sleeper.py", tmp_path / "output.txt"
    script.write_text(SLEEPER.format(guard=GUARD, count=count))
    with (
        output.open("w") as out,
        subprocess.Popen([sys.executable, script], stdout=out, stderr=subprocess.DEVNULL) as it,
    ):
        deadline = time.monotonic() + 60
        while len(output.read_text().split()) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        it.send_signal(how)
        begun = len(output.read_text().split())
    assert begun >= 2
    workers = {int(word) for word in output.read_text().split() if word.isdigit()}
    deadline = time.monotonic() + 20
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(alive, workers))
    assert len(output.read_text().split()) <= begun + 2, "none was begun after that"


def test_a_script_without_a_guard_is_an_error(tmp_path):
    script = tmp_path / "bare.py"
    script.write_text(SLEEPER.format(guard="if True:", count=3))
    found = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=False)
    assert found.returncode != 0
    assert "no worker process can be started" in found.stderr


def test_the_environment_is_as_before_however_many_threads_start_processes(monkeypatch):
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    seen = []

    def start():
        for _ in range(200):
            with processes._isolation():
                seen.append(os.environ.get("PYTHONSAFEPATH"))

    threads = [threading.Thread(target=start) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(seen) == {"1"}
    assert "PYTHONSAFEPATH" not in os.environ
