"""Render a scaffold and write it to a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lsds import __version__
from lsds.cli.scaffold.names import Names
from lsds.cli.scaffold.plan import PLANS, Plan
from lsds.errors import DataError
from lsds.support.extras import require
from lsds.support.files import write_whole

TEMPLATES = Path(__file__).parent / "templates"


def rendered(names: Names) -> dict[str, str]:
    """Return the text of each file by its path. Raises MissingExtra without Jinja."""
    require("jinja2", extra="new", purpose="lsds new")
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    plan = PLANS[names.kind]
    jinja = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
    )
    files = {**plan.files}
    files |= {f"src/{{package}}/{name}": template for name, template in plan.modules.items()}
    files |= {f"tests/{name}": template for name, template in plan.tests.items()}
    values = _values(names, plan)
    made = {
        path.format(package=names.package): jinja.get_template(template.format(kind=names.kind)).render(values)
        for path, template in files.items()
    }
    return made | {f"src/{names.package}/py.typed": ""}


def next_commands(names: Names, folder: Path) -> tuple[str, ...]:
    """Return what to type next."""
    return (f"cd {folder}", "pip install -e '.[dev]'", "pytest", _try_it(names))


def require_room(folder: Path, *, force: bool = False) -> None:
    """Raise DataError if a folder is a file, or holds something and `force` is not set."""
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise DataError(f"{folder}: is not empty (choose another folder with --out, or overwrite with --force)")
    if folder.exists() and not folder.is_dir():
        raise DataError(f"{folder}: is not a folder (choose another one with --out)")


def write(names: Names, folder: Path, *, force: bool = False) -> tuple[Path, ...]:
    """Write the scaffold; return its files. With `force` files of the same name are replaced. Raises DataError."""
    require_room(folder, force=force)
    files = rendered(names)
    for path, text in files.items():
        write_whole(folder / path, text.encode())
    return tuple(folder / path for path in files)


def _try_it(names: Names) -> str:
    return PLANS[names.kind].try_it.format(name=names.name)


def _values(names: Names, plan: Plan) -> dict[str, Any]:
    return {
        "kind": names.kind,
        "name": names.name,
        "distribution": names.distribution,
        "package": names.package,
        "prefix": names.prefix,
        "version": __version__,
        "device": plan.device,
        "module": plan.module,
        "summary": plan.summary[0].upper() + plan.summary[1:],
        "try_it": _try_it(names),
        "backends": _backends(names, plan),
    }


def _backends(names: Names, plan: Plan) -> list[dict[str, Any]]:
    """Return what the manifest declares. The last one is that which the conformance kit checks."""
    if plan.device:
        real = {"name": names.name, "factory": "hardware:build", "options": "options:Options", "mock": False}
        mock = {"name": f"mock-{names.name}", "factory": "mock:build", "options": "options:MockOptions", "mock": True}
        simulated = f"{names.name} in the simulated cell"
        return [{**real, "summary": plan.summary}, {**mock, "summary": simulated}]
    member = f"{names.prefix}{plan.member}" if plan.options else plan.module
    options = f"{plan.module}:Options" if plan.options else ""
    factory = f"{plan.module}:{member}"
    return [{"name": names.name, "factory": factory, "options": options, "mock": False, "summary": plan.summary}]
