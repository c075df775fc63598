"""Shipped models with their cards, and their paths."""

from __future__ import annotations

from pathlib import Path

from lsds.errors import ModelError


def model_path(name: str, configured: str) -> Path:
    """Return the path given in a config, or if it is empty that of the shipped model `name`.

    Raises ModelError if no such model is shipped.
    """
    if configured:
        return Path(configured)
    shipped = Path(__file__).parent / f"{name}.onnx"
    if not shipped.is_file():
        raise ModelError(f"no model is shipped for '{name}': set the option model to a file of lsds learn train")
    return shipped
