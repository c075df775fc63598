"""The scaffold of each kind: its templates, the files that they become, and its backends."""

from __future__ import annotations

from dataclasses import dataclass, field

_DEVICE = {
    "driver.py": "{kind}/driver.py.j2",
    "hardware.py": "{kind}/hardware.py.j2",
    "mock.py": "{kind}/mock.py.j2",
}
_OVER_TCP = {"client.py": "device/client.py.j2", "options.py": "device/options.py.j2"}
_MOVES = {"interface.py": "{kind}/interface.py.j2"}
_ALSO_TESTED = ("fault", "wire_mock", "study", "command")
"""Kinds whose scaffold has its own test in addition to the kit."""
_COMMON = {
    "pyproject.toml": "common/pyproject.toml.j2",
    "README.md": "common/readme.md.j2",
    ".github/workflows/test.yml": "common/workflow.yml.j2",
    "src/{package}/__init__.py": "common/package.py.j2",
    "src/{package}/manifest.py": "common/manifest.py.j2",
}


@dataclass(frozen=True, slots=True)
class Plan:
    """One kind's scaffold.

    `modules` and `tests` map files of the package and of its tests to templates. `module` holds the algorithm of a kind
    that is no device; `member` ends the name of its class, empty if the backend takes no options. `try_it` is a command
    that uses the result.
    """

    summary: str
    modules: dict[str, str]
    tests: dict[str, str]
    try_it: str
    module: str = ""
    member: str = ""
    device: bool = False
    options: bool = True
    files: dict[str, str] = field(default_factory=lambda: dict(_COMMON))


def _device(kind: str, summary: str, *more: str, over_tcp: bool = True, try_it: str = "") -> Plan:
    modules = (
        _DEVICE
        | (_MOVES if kind in ("gripper", "arm") else {})
        | (_OVER_TCP if over_tcp else {"options.py": f"{kind}/options.py.j2"})
    )
    tests = {"test_{package}.py": "common/test_kit.py.j2"}
    if over_tcp:
        tests["test_{package}_client.py"] = "device/test_client.py.j2"
    tests |= {f"test_{{package}}_{name}.py": f"{kind}/test_{name}.py.j2" for name in more}
    return Plan(summary, modules, tests, try_it or f"lsds run --set {kind}.backend=mock-{{name}}", device=True)


def _algorithm(kind: str, summary: str, try_it: str, module: str = "") -> Plan:
    module = module or kind
    own = f"{kind}/test_{module}.py.j2"
    tests = {"test_{package}.py": "common/test_kit.py.j2"}
    if kind in _ALSO_TESTED:
        tests[f"test_{{package}}_{module}.py"] = own
    modules = {f"{module}.py": f"{kind}/{module}.py.j2"}
    member = module.capitalize()
    return Plan(summary, modules, tests, try_it, module, member, options=kind != "command")


def _chosen(kind: str, summary: str) -> Plan:
    return _algorithm(kind, summary, f"lsds run --set {kind}.backend={{name}}")


PLANS: dict[str, Plan] = {
    "gripper": _device("gripper", "a parallel gripper", "lift"),
    "arm": _device("arm", "an arm that follows Cartesian velocities"),
    # Its drawn image has no imprint to follow, so a lift with it proves nothing.
    "sensor": _device(
        "sensor", "a camera-based tactile fingertip", over_tcp=False, try_it="lsds check sensor:mock-{name}"
    ),
    "pose_source": _device("pose_source", "poses of gripper and object"),
    "tracker": _chosen("tracker", "markers followed by their centroid"),
    "detector": _chosen("detector", "slip if the markers move fast"),
    "estimator": _chosen("estimator", "slip velocity from the mean marker velocity"),
    "controller": _chosen("controller", "closes by a step that grows with the slip speed"),
    "job": _chosen("job", "grasp, lift, hold"),
    "fault": _algorithm("fault", "the gripper reports an aperture that is off", "lsds run --fault {name}"),
    "wire_mock": _algorithm("wire_mock", "a gripper that answers lines of text", "lsds mock {name}", "server"),
    "study": _algorithm("study", "how far an object falls", "lsds study {name}"),
    "command": _algorithm("command", "counts the installed backends", "lsds {name}"),
}
"""The kinds that have a scaffold."""
