"""Scaffolds of all kinds in one folder, found by their entry points as if they were installed."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path

from installed import FIRST_PARTY

from lsds.cli.scaffold.names import Names, names_of
from lsds.cli.scaffold.plan import PLANS
from lsds.cli.scaffold.write import write
from lsds.registry import PluginHost

ROOT = Path(__file__).resolve().parents[2]
SOURCES = [str(ROOT), *(str(ROOT / folder) for folder in ("plugins", "drivers", "mocks"))]


@dataclass(frozen=True)
class Scaffolds:
    folder: Path
    names: dict[str, Names]

    def source(self, kind):
        return self.folder / kind / "src"

    @property
    def path(self):
        """The search path of a process that has them installed."""
        return os.pathsep.join([*(str(self.source(kind)) for kind in self.names), *SOURCES])

    def host(self, kind):
        """A host of the first-party plugins and of that scaffold, by the entry point of its pyproject.toml."""
        project = tomllib.loads((self.folder / kind / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        ((name, value),) = project["entry-points"]["lsds"].items()
        own = [EntryPoint(package.replace("_", "-"), f"{package}.manifest", "lsds") for package in FIRST_PARTY]
        return PluginHost(entry_points=[*own, EntryPoint(name, value, "lsds")])


def write_all(folder):
    """Write a scaffold of each kind; the names differ, so that all can be imported side by side."""
    names = {kind: names_of(kind, f"acme-{kind.replace('_', '-')}") for kind in PLANS}
    for kind, own in names.items():
        write(own, folder / kind)
        info = folder / kind / "src" / f"{own.package}-0.1.0.dist-info"
        info.mkdir()
        metadata = f"Metadata-Version: 2.1\nName: {own.distribution}\nVersion: 0.1.0\n"
        (info / "METADATA").write_text(metadata, encoding="utf-8")
        entry = f"[lsds]\n{own.distribution} = {own.package}.manifest\n"
        (info / "entry_points.txt").write_text(entry, encoding="utf-8")
    return Scaffolds(folder, names)
