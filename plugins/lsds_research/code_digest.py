"""A digest of the project's code: runs that were stored by other code may have other results."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("lsds", "lsds_drivers", "lsds_mocks", "lsds_plugins", "lsds_research")
"""Packages whose code decides what a run gives."""


@cache
def code_digest() -> str:
    """Return a digest of all modules of the project that are installed."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        if find_spec(package) is None:
            continue
        root = Path(str(files(package)))
        for file in sorted(root.rglob("*.py")):
            digest.update(str(file.relative_to(root)).encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]
