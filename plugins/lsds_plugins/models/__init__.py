"""Shipped models with their cards, and where they are."""

from __future__ import annotations

from pathlib import Path

from lsds.errors import ModelError


def model_path(name: str, told: str) -> Path:
    """Return the path that a config tells, else that of the model shipped under that name.

    Raises ModelError where there is none.
    """
    if told:
        return Path(told)
    shipped = Path(__file__).parent / f"{name}.onnx"
    if not shipped.is_file():
        raise ModelError(f"no model is shipped for '{name}': set the option model to one that lsds train has written")
    return shipped
