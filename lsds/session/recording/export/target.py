"""The place of an export: a new folder that stays only if it holds something usable."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lsds.errors import DataError


class Target:
    """A folder under construction. `usable` is set when its content is worth keeping after an error."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.usable = False


@contextmanager
def new_folder(path: Path) -> Iterator[Target]:
    """Create a folder; remove it after an error, unless its content is `usable`.

    Raises DataError: the path exists, its parent is missing, or the disk refuses.
    """
    try:
        path.mkdir()
    except FileExistsError as error:
        raise DataError(
            f"{path}: exists already, and an export overwrites nothing (choose another name, or remove it)"
        ) from error
    except FileNotFoundError as error:
        raise DataError(f"{path}: the export cannot be written: no folder {path.parent} (create it)") from error
    except OSError as error:
        raise failed(path, error) from error
    target = Target(path)
    try:
        yield target
    except BaseException as error:
        if not target.usable:
            shutil.rmtree(path, ignore_errors=True)
        if isinstance(error, OSError):
            raise failed(path, error) from error
        raise


def failed(path: Path, error: OSError) -> DataError:
    """Return the error for a disk that refuses an export."""
    return DataError(
        f"{path}: the export cannot be written: {error.strerror or error} (free some space, or choose another folder)"
    )
