"""Checks of faults: a fault keeps the contract of its part, begins with its moment and keeps the form of answers."""

from __future__ import annotations

from lsds.contracts.fault import OBSERVER
from lsds.contracts.kinds import KINDS
from lsds.contracts.stages import NEVER
from lsds.errors import ConfigError, LsdsError
from lsds.testing.afflicting import (
    DEVICES,
    Afflicted,
    Outcome,
    fields_of,
    first_difference,
    log_difference,
    options_of,
)
from lsds.testing.bench import Bench
from lsds.testing.exact import form
from lsds.testing.outcomes import NotApplicable

SEVERITIES = (1, 2, 3, 4, 5)
"""The scale of every fault that has an option `severity`."""
NO_SEVERITIES = (-1, 0, 6)
"""Values that a fault must refuse as its severity."""
_DECLARED = {"controller": ("may_open", "limits_force", "held_back"), "job": ("stages",)}
_CALLS = {
    **dict.fromkeys(DEVICES, ("connect", "arm", "stop", "disarm", "close")),
    **dict.fromkeys(("tracker", "detector", "estimator", "controller"), ("reset",)),
}
_VALUES = {"sensor": ("spec",), "gripper": ("spec",), "arm": ("spec",), **_DECLARED}


def check_afflicts_a_part_of_a_rig(bench: Bench) -> None:
    """`target` is a kind of part of a rig or "observer", `moment` the name of a stage, and both stay the same."""
    afflicted = Afflicted(bench)
    fault = afflicted.fault
    named = fault.target, fault.moment
    names_a_stage = isinstance(fault.moment, str) and bool(fault.moment)
    assert names_a_stage, f"moment is {fault.moment!r}; return the name of a stage, or lsds.contracts.stages.START"
    list(afflicted.outcomes())
    now = fault.target, fault.moment
    assert now == named, f"target and moment were {named} and are {now}; take them from the options, once"


def check_every_severity_builds(bench: Bench) -> None:
    """A fault with an option `severity` builds and runs at each of 1 to 5."""
    _require_severity(bench)
    for severity in SEVERITIES:
        try:
            afflicted = Afflicted(bench, {"severity": severity})
        except AssertionError:
            raise
        except Exception as error:
            raise AssertionError(f"severity {severity}: building it raised {_cause(error)}; support 1 to 5") from error
        for outcome in afflicted.outcomes():
            _require_named_error(afflicted, outcome, f"severity {severity}, ")


def check_other_severities_are_refused(bench: Bench) -> None:
    """A severity below 1 or above 5 is refused with one ConfigError about `severity`."""
    _require_severity(bench)
    for severity in NO_SEVERITIES:
        remedy = "declare it as Field(ge=1, le=5)"
        try:
            Afflicted(bench, {"severity": severity})
        except ConfigError as error:
            paths = [issue.path for issue in error.issues]
            assert "severity" in " ".join(paths), f"severity {severity} is refused because of {paths}; {remedy}"
            assert len(paths) == 1, (
                f"severity {severity} is refused with {len(paths)} problems, of {', '.join(paths)}; {remedy}"
            )
            continue
        except Exception as error:
            raise AssertionError(f"severity {severity} raised {_cause(error)}; {remedy}") from error
        raise AssertionError(f"severity {severity} is accepted; {remedy}")


def check_part_keeps_its_contract(bench: Bench) -> None:
    """`around` returns an object with all members of the part's contract; that of an observer can be called."""
    afflicted = Afflicted(bench)
    whole, target = afflicted.whole, afflicted.target
    if target == OBSERVER:
        assert callable(whole), f"around(None) returned {type(whole).__name__}; return a function of a Cycle"
        return
    contract = KINDS[target].contract
    missing = [name for name in _members(contract) if not hasattr(whole, name)]
    assert not missing, (
        f"the {target} with the fault lacks {', '.join(missing)}; pass on to the part what the fault does not change "
        "(__getattr__)"
    )


def check_passes_on_what_it_leaves(bench: Bench) -> None:
    """Spec, life cycle, declarations and calls of the part are as they were, before the fault begins and after."""
    for begun in (False, True):
        afflicted = Afflicted(bench)
        part, whole, target = afflicted.part, afflicted.whole, afflicted.target
        if part is None:
            raise NotApplicable("an observer has no part")
        if begun:
            afflicted.begin()
        when = "after the fault has begun" if begun else "before the fault begins"
        for name in _VALUES.get(target, ()):
            own, found = getattr(part, name), getattr(whole, name, None)
            assert found == own, f"{when}, {name} is {found!r}, and that of the part {own!r}; return that of the part"
        for name in _CALLS.get(target, ()):
            part.log.clear()
            getattr(whole, name)()
            reached = [called for _, called, _ in part.log]
            assert name in reached, f"{when}, {name}() does not reach the part; pass it on"
            if target in DEVICES:
                assert whole.lifecycle is part.lifecycle, (
                    f"{when}, {name}() leaves the part {part.lifecycle.value} and lifecycle returns "
                    f"{whole.lifecycle.value}; return that of the part"
                )


def check_nothing_changes_before_its_moment(bench: Bench) -> None:
    """Until its moment, answers, errors and the calls that reach the part are those of the part without the fault."""
    afflicted, bare = Afflicted(bench), Afflicted(bench, bare=True)
    difference = first_difference(list(afflicted.outcomes(begins=False)), list(bare.outcomes(begins=False)))
    moment = afflicted.fault.moment
    remedy = f"do what the part does until lsds.contracts.stages.shared_stages(context).began_ns({moment!r}) is a time"
    assert not difference, f"before its moment {moment!r}, with the fault against without, {difference}; {remedy}"
    difference = log_difference(afflicted.part, bare.part)
    assert not difference, f"before its moment {moment!r}, with the fault against without, {difference}; {remedy}"


def check_takes_effect(bench: Bench) -> None:
    """Within 1.5 s of its moment an answer, an error or a call that reaches the part is another one."""
    afflicted, bare = Afflicted(bench), Afflicted(bench, bare=True)
    if afflicted.fault.moment == NEVER:
        raise NotApplicable("with these options it never begins")
    difference = first_difference(list(afflicted.outcomes()), list(bare.outcomes()))
    difference = difference or log_difference(afflicted.part, bare.part)
    assert difference, (
        f"nothing has changed 1.5 s after its moment {afflicted.fault.moment!r}, with {options_of(bench)}; begin with "
        "the stage of `moment`, and look at the options"
    )


def check_answers_keep_their_form(bench: Bench) -> None:
    """Answers keep their type and their arrays' shape and type, errors are LsdsErrors, unless it is `malformed`."""
    afflicted, bare = Afflicted(bench), Afflicted(bench, bare=True)
    for outcome, own in zip(afflicted.outcomes(), bare.outcomes(), strict=True):
        _require_named_error(afflicted, outcome)
        if isinstance(outcome.value, Exception) or _is_malformed(afflicted):
            continue
        wanted = {form(own.value), *({"NoneType", "float"} if afflicted.target == "controller" else set())}
        found = form(outcome.value)
        assert found in wanted, (
            f"{outcome.where}: the fault makes {found} of {form(own.value)}; keep the form with dataclasses.replace, "
            "or declare malformed = True if the form is what the fault is about"
        )


def _cause(error: Exception) -> str:
    """Return the text of an error of a factory, without that of the host around it."""
    first = error.__cause__ or error
    return f"{type(first).__name__}: {first}"


def _members(contract: type) -> list[str]:
    """Return the public members of a contract and of those that it extends."""
    return sorted({name for one in contract.__mro__[:-1] for name in vars(one) if not name.startswith("_")})


def _is_malformed(afflicted: Afflicted) -> bool:
    return bool(getattr(afflicted.fault, "malformed", False))


def _require_named_error(afflicted: Afflicted, outcome: Outcome, where: str = "") -> None:
    """Raise AssertionError for an exception that is no LsdsError, unless the fault is declared malformed."""
    error = outcome.value
    if afflicted.target == OBSERVER or _is_malformed(afflicted):
        return
    if isinstance(error, Exception) and not isinstance(error, LsdsError | EOFError):
        raise AssertionError(
            f"{where}{outcome.where}: raised {type(error).__name__}: {error}; raise an LsdsError, as a "
            f"{afflicted.target} does, or declare malformed = True"
        ) from error


def _require_severity(bench: Bench) -> None:
    if "severity" not in fields_of(bench):
        raise NotApplicable("it has no option severity")


FAULT_CHECKS = (
    check_afflicts_a_part_of_a_rig,
    check_every_severity_builds,
    check_other_severities_are_refused,
    check_part_keeps_its_contract,
    check_passes_on_what_it_leaves,
    check_nothing_changes_before_its_moment,
    check_takes_effect,
    check_answers_keep_their_form,
)
