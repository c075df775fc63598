"""The index of a recording's chunks, kept as the bytes that end the file: an hour has some ten thousand chunks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


class ChunkIndexes:
    """A stand-in for the list of chunk indexes in `mcap.writer.Writer`, with a tenth of its memory."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def append(self, index: Any) -> None:
        """Add the index of a chunk (`mcap.records.ChunkIndex`)."""
        from mcap.data_stream import RecordBuilder

        builder: Any = RecordBuilder()
        index.write(builder)
        self._bytes += builder.end()

    def __iter__(self) -> Iterator[ChunkIndexes]:
        """Yield this object, which writes all indexes at once."""
        yield self

    def write(self, builder: Any) -> None:
        """Write all indexes to a `mcap.data_stream.RecordBuilder`."""
        builder.write(self._bytes)


def keep_as_bytes(writer: Any) -> None:
    """Let a new `mcap.writer.Writer` keep its chunk indexes as bytes.

    The library has no option for this. A version that names the list differently keeps its own, which only takes more
    memory.
    """
    own = "_Writer__chunk_indices"
    if getattr(writer, own, None) == []:
        setattr(writer, own, ChunkIndexes())
