"""Libraries installed by the extras of lsds, and the error for a missing one."""

from __future__ import annotations

import importlib.util

from lsds.errors import MissingExtra

EXTRAS = {
    "pyarrow": "data",
    "onnx": "train",
    "scipy": "train",
    "skl2onnx": "train",
    "sklearn": "train",
    "torch": "train",
    "matplotlib": "plot",
    "numba": "sim",
    "distributed": "cluster",
    "ray": "ray",
    "pytest": "testing",
    "hypothesis": "testing",
    "jinja2": "new",
    "mcap": "record",
    "orjson": "record",
    "rerun": "view",
    "mcap_protobuf": "record",
    "foxglove_schemas_protobuf": "record",
    "plotly": "report",
    "mcap_ros2": "ros2",
    "gymnasium": "gymnasium",
    "mujoco": "mujoco",
}
"""Import name -> extra of lsds that installs it."""


def require(*names: str, extra: str, purpose: str = "this") -> None:
    """Raise MissingExtra if one of the libraries is not installed. Imports none of them.

    `purpose` names what needs them in the message. Call it before long work, not after.
    """
    if missing := [name for name in names if not importable(name)]:
        raise _missing(purpose, missing, extra)


def explained(error: ImportError) -> MissingExtra | None:
    """Return a MissingExtra for the import error of a library; None if no extra installs it."""
    name = (error.name or "").partition(".")[0]
    if name not in EXTRAS or not isinstance(error, ModuleNotFoundError) or importable(name):
        return None
    return _missing("this", [name], EXTRAS[name])


def importable(name: str) -> bool:
    """Return whether a module is installed, without importing it."""
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _missing(purpose: str, names: list[str], extra: str) -> MissingExtra:
    verb = "is" if len(names) == 1 else "are"
    return MissingExtra(
        f"{purpose} needs {', '.join(names)}, which {verb} not installed; "
        f"install with: pip install 'lsds-tactile[{extra}]'"
    )
