"""Shipped models with their cards, and their paths."""

from __future__ import annotations

from pathlib import Path

from lsds.errors import ModelError


def model_path(name: str, told: str) -> Path:
    """Return the path given in a config, else that of the shipped model of that name.

    Raises ModelError if there is none.
    """
    if told:
        return Path(told)
    shipped = Path(__file__).parent / f"{name}.onnx"
    if not shipped.is_file():
        raise ModelError(f"no model is shipped for '{name}': set the option model to a file written by lsds train")
    return shipped
