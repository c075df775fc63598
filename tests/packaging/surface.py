"""The public surface: the names that plugins and programs may rely on, with members and signatures.

`python -m tests.packaging.surface` stores it.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path

MODULES = ("lsds", "lsds.contracts", "lsds.registry", "lsds.contracts.plant", "lsds.testing")
STORED = Path(__file__).with_name("surface.txt")


def surface() -> list[str]:
    """Return every public name with its signature, and the members of classes and Protocols."""
    lines: list[str] = []
    for module_name in MODULES:
        module = importlib.import_module(module_name)
        for name in sorted(getattr(module, "__all__", [])):
            lines += _lines(f"{module_name}.{name}", getattr(module, name))
    return lines


def _lines(name: str, value: object) -> Iterator[str]:
    if inspect.isclass(value):
        yield f"{name}: class"
        fields = (
            {field.name: field.type for field in dataclasses.fields(value)} if dataclasses.is_dataclass(value) else {}
        )
        for field, kind in fields.items():
            yield f"{name}.{field}: {kind}"
        for member, own in sorted(vars(value).items()):
            if member.startswith("_") or member in fields:
                continue
            if isinstance(own, property):
                yield f"{name}.{member}: property"
            elif inspect.isfunction(own):
                yield f"{name}.{member}{_signature(own)}"
    elif inspect.isfunction(value):
        yield f"{name}{_signature(value)}"
    else:
        yield f"{name}: {type(value).__name__}"


def _signature(function: object) -> str:
    return str(inspect.signature(function))  # type: ignore[arg-type]


if __name__ == "__main__":
    STORED.write_text("\n".join(surface()) + "\n", encoding="utf-8")
