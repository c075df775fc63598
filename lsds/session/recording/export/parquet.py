"""A recording as Parquet: a folder with one file per topic."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsds.errors import DataError
from lsds.session.recording.export.kinds import Columns
from lsds.session.recording.export.target import new_folder
from lsds.session.recording.reader import Recording
from lsds.session.recording.tables import fitted, kinds_of, row_of, schema_of_table
from lsds.support.extras import require

GROUP_BYTES = 8_000_000
"""Size of the messages of one topic that are written together as a row group: it bounds the memory of an export."""


def to_parquet(path: Path, out: Path, progress: Callable[[int, int], None] | None = None) -> dict[str, int]:
    """Write the streams of a recording to a new folder; return the rows by topic.

    The file of topic /a/b is `a.b.parquet`. Raises MissingExtra, DataError.
    """
    require("pyarrow", extra="data", purpose="an export to Parquet")
    recording = Recording(path)
    # The first pass finds the columns, since a Parquet file states them before its rows.
    columns: dict[str, Columns] = {}
    whole = 0
    for raw in recording.messages():
        if raw.topic not in columns:
            columns[raw.topic] = Columns(recording.schemas.get(raw.schema, b""))
        columns[raw.topic].see(row_of(raw, path))
        whole += 1
    if not whole:
        raise DataError(f"{path}: no message to export")
    with new_folder(out):
        files = {topic: _TopicFile(out, topic, own) for topic, own in columns.items()}
        try:
            for number, raw in enumerate(recording.messages(), 1):
                files[raw.topic].add(row_of(raw, path), len(raw.data))
                if progress is not None:
                    progress(number, whole)
        finally:
            for file in files.values():
                file.close()
    return {topic: file.rows for topic, file in sorted(files.items())}


class _TopicFile:
    """The Parquet file of one topic. `rows` is the number of rows so far."""

    def __init__(self, folder: Path, topic: str, columns: Columns) -> None:
        import pyarrow.parquet

        self.rows = 0
        self._kinds = kinds_of(columns)
        self._schema = schema_of_table(self._kinds).with_metadata({"topic": topic})
        name = topic.strip("/").replace("/", ".")
        self._writer = pyarrow.parquet.ParquetWriter(folder / f"{name}.parquet", self._schema, compression="zstd")
        self._waiting: list[dict[str, Any]] = []
        self._bytes = 0

    def add(self, row: dict[str, Any], size: int) -> None:
        """Take in a row of a message of this size in bytes."""
        self._waiting.append(row)
        self._bytes += size
        self.rows += 1
        if self._bytes > GROUP_BYTES:
            self._flush()

    def close(self) -> None:
        """Write the rest."""
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        import pyarrow

        if self._waiting:
            rows = fitted(self._waiting, self._kinds)
            self._writer.write_table(pyarrow.Table.from_pylist(rows, schema=self._schema))
        self._waiting, self._bytes = [], 0
