"""The process of a client under test: calls its methods as requested, one JSON object per line.

Standard output carries the answers, so what the client prints goes to standard error.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
from typing import IO, Any

IMAGE_ROWS = 24
"""Height of the grey image that stands for a camera's image, px."""
IMAGE_COLUMNS = 32
"""Width of that image, px."""


def main(named: str) -> None:
    """Serve the class MODULE:CLASS until the input ends."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    sys.path.insert(0, os.getcwd())
    client: Any = None
    try:
        kind = _class_of(named)
    except Exception as error:
        _write(answers, {"error": f"{type(error).__name__}: {error}"})
        return
    options = dict(getattr(kind, "options", {}))
    _write(answers, {"value": {"transport": getattr(kind, "transport", ""), "options": options}})
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if request["call"] == "connect":
                client = kind(*request["args"])
                value = None
            else:
                value = _plain(getattr(client, request["call"])(*request["args"]))
        except Exception as error:
            _write(answers, {"error": f"{type(error).__name__}: {error}"})
        else:
            _write(answers, {"value": value})


def _class_of(named: str) -> Any:
    module, separator, name = named.partition(":")
    if not separator:
        raise ValueError(f"'{named}' is not MODULE:CLASS")
    return getattr(importlib.import_module(module), name)


def _plain(value: Any) -> Any:
    """Return a value for JSON: a number, None, or for an image its size and a small grey version of it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    import numpy as np

    array = np.asarray(value)
    if array.ndim == 0:
        return float(array)
    if array.ndim != 3:
        raise TypeError(f"an answer must be a number or an image (height, width, 3), not an array {array.shape}")
    rows = np.linspace(0, len(array), IMAGE_ROWS + 1).astype(int)
    columns = np.linspace(0, array.shape[1], IMAGE_COLUMNS + 1).astype(int)
    grey = np.add.reduceat(np.add.reduceat(array.mean(axis=2), rows[:-1], axis=0), columns[:-1], axis=1)
    grey /= np.maximum(np.outer(np.diff(rows), np.diff(columns)), 1)
    return {"size": list(array.shape), "grey": np.round(grey, 1).tolist()}


def _write(answers: IO[str], answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer) + "\n")
    answers.flush()


if __name__ == "__main__":
    main(sys.argv[1])
