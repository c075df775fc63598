"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import NamedTemporaryFile

from lsds.errors import DataError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file whole or not at all. Raises DataError where it cannot, naming the remedy."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            beside = Path(file.name)
            try:
                file.write(content)
                # On the disk before it has the name: a power cut leaves the old file or the new one.
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
            f"{path}: cannot be written: {error.strerror or error} (make room or choose another folder; what was "
            "recorded before is kept)"
        ) from error
