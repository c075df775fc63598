"""The script language: what programs say, and how they end."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.wire.ur.controller import Controller
from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.functions import Library, waiting
from lsds_mocks.wire.ur.messages import KeyMessage, RuntimeExceptionMessage, TextMessage
from lsds_mocks.wire.ur.options import UrOptions
from lsds_mocks.wire.ur.script.compiler import compile_script
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.stream import ScriptStream


def run(text, cycles=3000):
    controller = Controller(UrOptions(), Environment(), Library)
    controller.start(compile_script(text, waiting()))
    for _ in range(cycles):
        controller.cycle()
        if controller.program is None:
            break
    return controller, list(controller.messages)


def log_of(body, cycles=3000):
    """Return the log of a program's body; fail if it ends in an error."""
    text = "def program():\n" + body + "\nend\n"
    _, messages = run(text, cycles)
    assert [m for m in messages if isinstance(m, RuntimeExceptionMessage)] == []
    return [m.text for m in messages if isinstance(m, TextMessage)]


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("textmsg(1 + 2 * 3 - 4 / 2)", "5"),
        ("textmsg((1 + 2) * 3 % 4)", "1"),
        ("textmsg(-2 * [1, 2, 3] + [1, 1, 1] / 2)", "[-1.5, -3.5, -5.5]"),
        ("textmsg(True and not False or False)", "True"),
        ("textmsg(True xor True)", "False"),
        ("textmsg(1 < 2 and 2 >= 2 and 1 != 2)", "True"),
        ('textmsg("a#b", 3)', "a#b3"),
        ("textmsg(0x10)", "16"),
        ("textmsg(p[1, 2, 3, 0, 0, 0.5])", "p[1, 2, 3, 0, 0, 0.5]"),
        ("p = [4, 5]\ntextmsg(p[1])", "5"),
        ("m = [[1, 2], [3, 4]]\ntextmsg(m[1, 0])", "3"),
        ("a = [1, 2]\nb = a\nb[0] = 9\ntextmsg(a)", "[1, 2]"),
        ("s = struct(x=1, y=[1, 2])\ns.y[1] = 7\ntextmsg(s.y)", "[1, 7]"),
        ("l = [1]\nl.append(2)\ntextmsg(l.length())", "2"),
        ("x =\n5\ny = 6 textmsg(x + y)", "11"),
        ("if 1 == 2 or\n  3 == 3:\n  textmsg(1)\nelse:\n  textmsg(2)\nend", "1"),
        ("i = 0\nwhile True:\n  i = i + 1\n  if i > 4:\n    break\n  end\nend\ntextmsg(i)", "5"),
        ('textmsg(str_cat("q=", [1, 2.5]))', "q=[1, 2.5]"),
        ('textmsg(to_num("1.5") + pow(2, 2))', "5.5"),
        ("textmsg(norm([3, 4]))", "5"),
        ("textmsg(norm(-3))", "3"),
    ],
)
def test_expressions_and_statements(body, expected):
    assert log_of(body) == [expected]


def test_functions_take_defaults_and_names_and_do_not_change_their_callers_lists():
    body = """
      def add(q, by=1, times=2):
        q[0] = q[0] + by * times
        return q
      end
      q = [1, 0]
      textmsg(add(q, times=3), q)
    """
    assert log_of(body) == ["[4, 0][1, 0]"]


def test_variables_of_the_program_are_everybodys_and_those_of_functions_their_own():
    body = """
      shared = 1
      def f():
        shared = 2
        own = 3
        local shared_too = own
        global declared = shared_too
      end
      f()
      textmsg(shared, declared)
    """
    assert log_of(body) == ["23"]


def test_local_hides_what_all_share():
    assert log_of("x = 1\ndef f():\n local x = 2\n textmsg(x)\nend\nf()\ntextmsg(x)") == ["2", "1"]


def test_threads_run_side_by_side_are_joined_and_killed():
    body = """
      n = 0
      thread counts():
        while True:
          n = n + 1
          sync()
        end
      end
      thread ends():
        sleep(0.02)
        textmsg("ended")
      end
      a = run counts()
      b = run ends()
      join b
      kill a
      before = n
      sleep(0.02)
      kill 0
      textmsg(n == before and n > 5)
    """
    assert log_of(body) == ["ended", "True"]


def test_a_critical_section_lets_others_run_while_it_waits():
    body = """
      done = False
      thread other():
        done = True
      end
      h = run other()
      enter_critical
      while not done:
        sync()
      end
      exit_critical
      textmsg("out")
    """
    assert log_of(body) == ["out"]


def test_halt_ends_everything():
    body = "thread t():\n while True:\n  sync()\n end\nend\nrun t()\nhalt\ntextmsg(1)"
    assert log_of(body) == []


def test_sleep_takes_its_time_in_cycles():
    controller, _ = run("def f():\n sleep(0.1)\nend")
    assert controller.step_number == pytest.approx(50, abs=2)


@pytest.mark.parametrize(
    ("text", "message", "line", "column"),
    [
        ("def illegal_fun():\n  calldoesntexist()\nend", "compile_error_name_not_found:calldoesntexist:", 2, 3),
        ("def f():\n  x = y + 1\nend", "compile_error_name_not_found:y:", 2, 7),
        ("def f():\n  if True:\n  textmsg(1)\nend", "syntax_error_on_line:4:", 4, 4),
        ("def f():\n  x = ?\nend", "syntax_error_on_line:2:", 2, 7),
        ("def f():\n  break\nend", "syntax_error_on_line:2:", 2, 3),
    ],
)
def test_what_cannot_run_is_refused_with_its_place(text, message, line, column):
    with pytest.raises(ScriptError) as caught:
        compile_script(text, waiting())
    assert (caught.value.text, caught.value.line, caught.value.column) == (message, line, column)


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ("x = 1 / 0", 2),
        ("x = [1, 2] + [1]", 2),
        ("x = 1\nmovej(p[0, 0, 0, 0, 0, 0])", 3),
        ("read_input_float_register(48)", 2),
    ],
)
def test_a_runtime_error_ends_the_program_and_reports_the_line(body, line):
    controller, messages = run(f"def f():\n{body}\nend")
    assert [m.line for m in messages if isinstance(m, RuntimeExceptionMessage)] == [line]
    assert controller.program is None


def test_a_loop_that_never_waits_is_stopped_instead_of_the_controller():
    controller, messages = run("def f():\n  while True:\n    x = 1\n  end\nend")
    assert any("infinite loop" in m.text for m in messages if isinstance(m, RuntimeExceptionMessage))
    assert controller.program is None


def test_programs_report_start_and_stop_but_secondary_ones_do_not():
    _, messages = run("def hello():\n  sync()\nend")
    assert messages == [KeyMessage("PROGRAM_XXX_STARTED", "hello"), KeyMessage("PROGRAM_XXX_STOPPED", "hello")]
    controller, messages = run("sec quiet():\n  textmsg(1)\nend", cycles=5)
    assert messages == [TextMessage("1")]
    assert controller.secondaries == []


def test_a_new_program_takes_the_place_of_the_running_one():
    controller = Controller(UrOptions(), Environment(), Library)
    for name in ("one", "two"):
        controller.start(compile_script(f"def {name}():\n while True:\n  sync()\n end\nend", waiting()))
        controller.cycle()
    assert controller.program.name == "two"
    assert KeyMessage("PROGRAM_XXX_STOPPED", "one") in controller.messages


@given(st.lists(st.integers(0, 200), max_size=8))
def test_a_stream_gives_the_same_programs_however_it_is_cut(cuts):
    text = b'textmsg("end")\ndef a():\n if True: # end\n  x = 1\n end\nend\n\nsec b():\nend\npower on\n'
    stream, found, at = ScriptStream(), [], 0
    for cut in [*sorted(min(c, len(text)) for c in cuts), len(text)]:
        found += stream.feed(text[at:cut])
        at = cut
    assert found == [
        'textmsg("end")',
        "def a():\n if True: # end\n  x = 1\n end\nend",
        "sec b():\nend",
        "power on",
    ]


@settings(max_examples=200)
@given(st.text(alphabet='abp01.+-*/[](){}=:,"# \n<>!', max_size=60))
def test_no_text_brings_the_compiler_down(text):
    with contextlib.suppress(ScriptError):
        compile_script("def f():\n" + text + "\nend\n", waiting())


def test_secondary_programs_do_not_pile_up():
    controller = Controller(UrOptions(), Environment(), Library)
    endless = compile_script("sec forever():\n while True:\n  sync()\n end\nend", waiting())
    for _ in range(30):
        controller.start(endless)
        controller.cycle()
    assert len(controller.secondaries) == 16
    assert any("secondary programs" in m.text for m in controller.messages if isinstance(m, RuntimeExceptionMessage))
