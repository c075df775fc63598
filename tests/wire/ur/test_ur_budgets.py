"""One program cannot stop the controller: what it does in a cycle has a limit, and so has what it keeps."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from lsds_mocks.mock_process import MockProcess
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library, waiting
from lsds_mocks.wire.ur.memory import LIMIT_BYTES, MemoryWatch
from lsds_mocks.wire.ur.messages import RuntimeExceptionMessage, TextMessage
from lsds_mocks.wire.ur.options import UrOptions
from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.work import BURST, CYCLE

from tests.wire.ur.abusive_scripts import ENDED, GOES_ON, REFUSED
from tests.wire.ur.arms import Primary, fresh_host
from tests.wire.ur.random_scripts import script
from tests.wire.ur.test_ur_abuse import memory_mb, undisturbed
from tests.wire.waiting import until

ONE_CYCLE_S = 2.0
"""The longest that a cycle may take here; it takes a hundredth of that on a machine that does nothing else."""


class Bench:
    """A controller with its messages; fails if a cycle exceeds its budget or does not end."""

    def __init__(self):
        self.controller = Controller(UrOptions(), Environment(), Library)

    def run(self, text, cycles=200):
        self.controller.start(compile_script(text, waiting()))
        for _ in range(cycles):
            began = time.monotonic()
            self.controller.cycle()
            assert time.monotonic() - began < ONE_CYCLE_S
            assert self.controller.work.spent <= BURST
            if not self.controller.busy:
                break
        messages = list(self.controller.messages)
        self.controller.messages.clear()
        return [m.text for m in messages if isinstance(m, RuntimeExceptionMessage)], [
            m.text for m in messages if isinstance(m, TextMessage)
        ]


def program(body):
    return f"def program():\n{body}\nend\n"


GOOD = program('i = 0\nwhile i < 50:\n i = i + 1\n sync()\nend\ntextmsg("good")')


@pytest.mark.parametrize("body", ENDED.values(), ids=ENDED)
def test_it_ends_in_an_error_and_the_next_program_runs(body):
    bench = Bench()
    errors, _ = bench.run(program(body))
    assert len(errors) == 1
    assert bench.run(GOOD) == ([], ["good"])


@pytest.mark.parametrize("body", REFUSED.values(), ids=REFUSED)
def test_it_is_refused_before_it_starts(body):
    with pytest.raises((ScriptError, RecursionError, MemoryError, SyntaxError)):
        compile_script(program(body), waiting())


@pytest.mark.parametrize("body", GOES_ON.values(), ids=GOES_ON)
def test_what_takes_long_takes_more_cycles(body):
    bench = Bench()
    errors, _ = bench.run(program(body), cycles=1000)
    assert errors == []
    assert bench.controller.program is not None
    assert bench.controller.work.spent <= CYCLE
    bench.controller.stop_program()


def test_a_program_whose_every_cycle_takes_too_long_is_ended_when_its_savings_are_spent():
    bench = Bench()
    body = "while True:\n i = 0\n while i < {}:\n  i = i + 1\n end\n sync()\nend"
    errors, _ = bench.run(program(body.format(200)), cycles=500)
    assert errors == []
    errors, _ = bench.run(program(body.format(4000)), cycles=500)
    assert len(errors) == 1
    assert "infinite loop" in errors[0]


def test_a_long_calculation_at_the_start_is_let_pass():
    assert Bench().run(program('i = 0\nwhile i < 10000:\n i = i + 1\nend\ntextmsg("done")')) == ([], ["done"])


def test_who_spends_everything_leaves_the_others_enough():
    bench = Bench()
    bench.controller.start(compile_script("def good():\n while True:\n  x = sin(1)\n  sync()\n end\nend\n", waiting()))
    for _ in range(100):
        errors, _ = bench.run("sec bad():\n while True:\n  x = 1\n end\nend\n", cycles=2)
        assert len(errors) == 1
    assert bench.controller.program is not None


def test_random_programs_keep_to_the_budget():
    bench = Bench()
    assert sum(random_program_ends(bench, seed) for seed in range(150)) > 20


@pytest.mark.slow
def test_ten_thousand_random_programs_keep_to_the_budget():
    bench, watch = Bench(), MemoryWatch()
    for seed in range(10_000):
        random_program_ends(bench, seed)
        assert not watch.exceeded(busy=True)


def random_program_ends(bench, seed):
    """Run a random program for a while; return whether it was running."""
    try:
        bench.run(script(seed), cycles=20)
    except (ScriptError, RecursionError, SyntaxError):
        return False
    bench.controller.stop_program()
    bench.controller.safety = type(bench.controller.safety).NORMAL
    if seed % 25 == 0:
        assert bench.run(GOOD) == ([], ["good"])
    return True


# -- values ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("textmsg(2147483647 + 1)", "-2147483648"),
        ("textmsg(-2147483648 - 1)", "2147483647"),
        ("textmsg(65536 * 65536)", "0"),
        ("textmsg(46341 * 46341)", "-2147479015"),
        ("textmsg(0xFFFFFFFF)", "-1"),
        ("textmsg(-(-2147483648))", "-2147483648"),
        ("textmsg(3000000000 / 1000)", "3000000"),
        ("textmsg(2147483647 + 1.0)", "2147483648"),
        ("textmsg(7 / 2)", "3.5"),
        ("textmsg([2147483647] + 1)", "[-2147483648]"),
        ('textmsg(to_num("3000000000") > 2)', "True"),
        ("a = [1]\nb = [a, a]\nb[0][0] = 5\ntextmsg(a, b)", "[1][[5], [1]]"),
        ("s = struct(x=1)\nt = s\nt.x = 2\ntextmsg(s.x, t.x)", "12"),
        ("l = [1]\ndef f():\n return l\nend\nm = f()\nm[0] = 2\ntextmsg(l, m)", "[1][2]"),
    ],
)
def test_integers_have_32_bits_and_values_share_nothing(body, expected):
    assert Bench().run(program(body)) == ([], [expected])


@pytest.mark.parametrize(
    "body",
    [
        "x = [1, 2]\ny = x[-1]",
        "x = [1, 2]\nx[-1] = 0",
        "x = [1, 2]\ny = x[2]",
        'x = str_at("abc", -1)',
        'x = str_sub("abc", -2, 1)',
        "x = [1, 2]\nx.remove(-1)",
        'x = to_num("1e999")',
        "x = floor(3e9)",
        "x = [1, 2] < [1, 3]",
        'x = 1 < "a"',
        "x = [1] + [[1], 2]",
        "x = 5\ny = x[0]",
    ],
)
def test_what_has_no_value_is_an_error(body):
    errors, _ = Bench().run(program(body))
    assert len(errors) == 1


@pytest.mark.parametrize("literal", ["1e999", "-1e999", "1" + "0" * 400])
def test_a_number_that_is_none_is_refused_with_its_line(literal):
    with pytest.raises(ScriptError) as refused:
        compile_script(program(f"x = 1\ny = {literal}"), waiting())
    assert refused.value.line == 3


# -- on the wire ----------------------------------------------------------------------------------------------


ON_THE_WIRE = [
    *("squares", "texts double", "lists double", "lists of lists", "recursion", "a long program", "messages"),
    *("brackets", "branches", "many functions", "inverse kinematics", "reads of nothing"),
]


def test_all_ports_go_on_while_programs_are_ended_and_a_good_one_runs_after_each(host, arm):
    before = memory_mb(arm)
    with Primary(host) as primary:
        for name in ON_THE_WIRE:
            body = {**ENDED, **REFUSED, **GOES_ON}[name]
            with undisturbed(host):
                primary.send(program(body))
                if name in GOES_ON:
                    time.sleep(0.2)
                else:
                    assert primary.message(10)
            assert memory_mb(arm) - before < 200
            primary.send(GOOD)
            while primary.message(0) != b"good":
                pass


def test_programs_that_keep_too_much_are_ended_from_outside():
    bench = Bench()
    bench.controller.start(compile_script("sec also():\n while True:\n  sync()\n end\nend\n", waiting()))
    bench.controller.start(compile_script(program("x = make_list(1000, 1)\nsleep(9)"), waiting()))
    bench.controller.cycle()
    bench.controller.fail_programs(ScriptError("runtime_error: out of memory"))
    assert not bench.controller.busy
    errors, _ = bench.run(GOOD)
    assert errors == ["runtime_error: out of memory"] * 2


@pytest.mark.slow
def test_a_program_that_keeps_ever_more_is_ended(host, arm):
    before = memory_mb(arm)
    with Primary(host) as primary, undisturbed(host):
        body = "x = []\nwhile True:\n x.append(make_list(2000, 1))\n sync()\nend"
        primary.send(program(body).replace("program", "hoards"))
        assert b"out of memory" in primary.message(10)
        primary.send(GOOD)
        assert primary.message(0) == b"good"
    assert memory_mb(arm) - before < 2 * LIMIT_BYTES / 1e6


def test_a_program_that_takes_long_to_compile_keeps_no_port_waiting(host):
    with Primary(host) as primary, undisturbed(host):
        primary.send(program("x = 1\n" + "x = x + 1\n" * 10_000 + 'textmsg("compiled")'))
        assert primary.message(0) == b"compiled"


def test_control_c_ends_a_mock_that_runs_an_endless_program():
    host = fresh_host()
    with MockProcess("ur5e", {"host": host}) as mock:
        with Primary(host) as primary:
            for body in (GOES_ON["inverse kinematics"], "x = 3\nwhile True:\n x = x * x\n sync()\nend"):
                primary.send(program(body))
                assert primary.message(7)
        pid = mock.pid
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        os.kill(pid, signal.SIGINT)
        assert until(lambda: not mock.alive, 10)
        assert until(lambda: not any(Path(f"/proc/{child}").exists() for child in children), 10)
