"""Atomic writing of files."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import NamedTemporaryFile

from lsds.errors import DataError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically. Raises DataError with a remedy if it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            beside = Path(file.name)
            try:
                file.write(content)
                # Flush to disk before renaming, so that a power failure leaves either the old or the new file.
                file.flush()
                os.fsync(file.fileno())
                file.close()
                beside.chmod(0o644)
                beside.replace(path)
            except BaseException:
                beside.unlink(missing_ok=True)
                raise
    except OSError as error:
        raise DataError(
            f"{path}: cannot be written: {error.strerror or error} (free some space or choose another folder; earlier "
            "recordings are kept)"
        ) from error
