"""Libraries that come with an extra of lsds, and what to install where one is missing."""

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
}
"""Import name -> extra of lsds that brings it."""


def require(*names: str, extra: str, purpose: str = "this") -> None:
    """Raise MissingExtra where one of the libraries cannot be imported. Imports none of them.

    `purpose` is what needs them, as the message says it. Call it before long work, not after.
    """
    if missing := [name for name in names if not importable(name)]:
        raise _missing(purpose, missing, extra)


def explained(error: ImportError) -> MissingExtra | None:
    """Return the error of a missing library as one that names its extra; None where no extra brings it."""
    name = (error.name or "").partition(".")[0]
    if name not in EXTRAS or not isinstance(error, ModuleNotFoundError) or importable(name):
        return None
    return _missing("this", [name], EXTRAS[name])


def importable(name: str) -> bool:
    """Tell whether a module is installed, without importing it."""
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _missing(purpose: str, names: list[str], extra: str) -> MissingExtra:
    verb = "is" if len(names) == 1 else "are"
    return MissingExtra(
        f"{purpose} needs {', '.join(names)}, which {verb} not installed; install with: pip install 'lsds[{extra}]'"
    )
