"""Files that config keys name: a stored run with another file of the same name is another run."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from lsds.config.reading import read_toml
from lsds_research.search.space import values_of


@lru_cache(maxsize=64)
def files_of_settings(settings: tuple[str, ...]) -> str:
    """Return a digest of the files (calibration, models, shapes) that settings `key=value` name, "" without one."""
    return _digest(_files(values_of(settings), Path()))


@lru_cache(maxsize=64)
def files_of_rig(rig: str) -> str:
    """Return a digest of a rig file and of the files that it names, "unreadable" if it cannot be read."""
    path = Path(rig)
    try:
        own = path.read_bytes()
    except OSError:
        return "unreadable"
    named = _digest(_files(read_toml(path), path.parent))
    return hashlib.sha256(own).hexdigest()[:12] + (f" {named}" if named else "")


def _files(value: Any, folder: Path) -> Iterator[Path]:
    """Yield the files that texts name, from a folder or from the current one."""
    if isinstance(value, Mapping):
        for inner in value.values():
            yield from _files(inner, folder)
    elif isinstance(value, str):
        yield from (path for path in (folder / Path(value).expanduser(), Path(value)) if value and _is_file(path))
    elif isinstance(value, Sequence):
        for inner in value:
            yield from _files(inner, folder)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _digest(files: Iterable[Path]) -> str:
    found = sorted({path.resolve() for path in files})
    whole = hashlib.sha256()
    for path in found:
        whole.update(hashlib.sha256(path.read_bytes()).digest())
    return whole.hexdigest()[:12] if found else ""
