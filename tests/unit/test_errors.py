from __future__ import annotations

import inspect

import pytest

from lsds import errors
from lsds.errors import ConfigError, ConfigIssue, DeviceError, LsdsError

CLASSES = [c for _, c in inspect.getmembers(errors, inspect.isclass) if issubclass(c, Exception)]


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__name__)
def test_every_error_is_in_the_tree_and_documents_when_it_is_raised(cls):
    assert issubclass(cls, LsdsError)
    assert cls.__doc__
    assert 1 <= cls.exit_code <= 125


def test_families_have_exit_codes_of_their_own():
    families = LsdsError.__subclasses__()
    by_code = {}
    for family in families:
        by_code.setdefault(family.exit_code, []).append(family.__name__)
    # Failing to come up is a failure of devices.
    assert {frozenset(names) for names in by_code.values() if len(names) > 1} <= {
        frozenset({"DeviceError", "BringUpError"})
    }


def test_a_config_error_shows_every_issue():
    error = ConfigError("rig.toml", [ConfigIssue("a.b", "is wrong", "make it right"), ConfigIssue("c", "is missing")])
    assert str(error) == "rig.toml: 2 problems\n  a.b: is wrong (make it right)\n  c: is missing"
    assert "1 problem\n" in str(ConfigError("x", [ConfigIssue("a", "b")]))


def test_a_device_error_states_what_where_and_what_to_do():
    error = DeviceError("hand-e", "no answer", remedy="check the cable", code=0x0A)
    assert str(error) == "hand-e: no answer [code 10] (check the cable)"
    assert str(DeviceError("hand-e", "no answer")) == "hand-e: no answer"
