"""The checks that the command `mcap doctor` makes (it is a program in Go), by the format's specification.

Records and their order, chunks and their checksums, times of chunks, channels and schemas known before they are used,
message and chunk indexes, statistics, and the end of the file: https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Message, MessageIndex, Schema, Statistics

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
KINDS = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.MESSAGE: Message,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.DATA_END: DataEnd,
    Opcode.FOOTER: Footer,
}


def records(data, begin):
    """Yield (offset, opcode, record, length with its head) of the records from an offset; None for other kinds."""
    at = begin
    while at < len(data):
        if at + HEAD.size > len(data):
            raise EOFError(f"a record is cut off at {at}")
        opcode, length = HEAD.unpack_from(data, at)
        content = data[at + HEAD.size : at + HEAD.size + length]
        if len(content) < length:
            raise EOFError(f"a record is cut off at {at}")
        kind = KINDS.get(opcode)
        read = None
        if kind is not None:
            stream = ReadDataStream(BytesIO(content))
            read = kind.read(stream, length) if kind is Message else kind.read(stream)
        yield at, opcode, read, HEAD.size + length
        at += HEAD.size + length


class Doctor:
    """Reads a file and notes what is wrong. `cut_off` is where it ends early, "" for a whole file."""

    def __init__(self, data):
        self.problems, self.cut_off = [], ""
        self._schemas, self._channels = {}, {}
        self._counts, self._chunks = Counter(), {}
        self._times = []
        self._offsets, self._indexes = {}, []
        if data[:8] != MAGIC:
            self.problems.append("no magic at the begin")
            return
        whole = data[-8:] == MAGIC
        try:
            self._file(data, len(data) - 8 if whole else len(data))
        except EOFError as error:
            self.cut_off = str(error)
            self._expect(not whole, f"{error}, before the end of the file")
        if not whole:
            self.cut_off = self.cut_off or "no magic at the end"

    def _expect(self, holds, problem):
        if not holds:
            self.problems.append(problem)

    def _file(self, data, end):
        ended, last_chunk = False, None
        for at, opcode, record, length in records(data[:end], 8):
            self._expect(at != 8 or opcode == Opcode.HEADER, "the first record is no header")
            if opcode == Opcode.CHUNK:
                self._expect(not ended, f"chunk at {at} behind the end of the data")
                last_chunk = at
                self._chunk(at, record, length)
            elif opcode == Opcode.MESSAGE_INDEX:
                self._index(last_chunk, record)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._known(record, at)
            elif opcode == Opcode.DATA_END:
                ended = True
                crc = zlib.crc32(data[:at])
                self._expect(record.data_section_crc in (0, crc), "checksum of the data section")
            elif opcode == Opcode.CHUNK_INDEX:
                self._expect(ended, "chunk index before the end of the data")
                self._indexed(record)
            elif opcode == Opcode.STATISTICS:
                self._expect(record.message_count == sum(self._counts.values()), "statistics: messages")
                self._expect(record.channel_message_counts == dict(self._counts), "statistics: messages by channel")
                self._expect(record.chunk_count == len(self._chunks), "statistics: chunks")
                self._expect(record.channel_count == len(self._channels), "statistics: channels")
                bounds = (min(self._times, default=0), max(self._times, default=0))
                self._expect((record.message_start_time, record.message_end_time) == bounds, "statistics: times")
            elif opcode == Opcode.FOOTER:
                self._expect(ended, "footer without an end of the data")
                start = record.summary_start
                crc = zlib.crc32(data[start : at + HEAD.size + 16])
                self._expect(record.summary_crc in (0, crc), "checksum of the summary")
                self._expect(at + length == end, "something behind the footer")
        if end < len(data):
            missing = set(self._chunks) - set(self._indexes)
            self._expect(not missing, f"chunks without an index: {sorted(missing)}")

    def _chunk(self, at, chunk, length):
        try:
            content = zstandard.decompress(chunk.data) if chunk.compression == "zstd" else chunk.data
        except zstandard.ZstdError as error:
            self.problems.append(f"chunk at {at}: {error}")
            return
        self._expect(chunk.compression in ("", "zstd"), f"compression of the chunk at {at}")
        self._expect(len(content) == chunk.uncompressed_size, f"size of the chunk at {at}")
        self._expect(chunk.uncompressed_crc in (0, zlib.crc32(content)), f"checksum of the chunk at {at}")
        own = {}
        try:
            inside = list(records(content, 0))
        except EOFError as error:
            self.problems.append(f"chunk at {at}: {error}")
            return
        for inner, opcode, record, _ in inside:
            if opcode == Opcode.MESSAGE:
                self._expect(record.channel_id in self._channels, f"message of an unknown channel in the chunk at {at}")
                in_time = chunk.message_start_time <= record.log_time <= chunk.message_end_time
                self._expect(in_time, f"time of a message outside of its chunk at {at}")
                own[inner] = record
                self._counts[record.channel_id] += 1
                self._times.append(record.log_time)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._known(record, at)
            else:
                self.problems.append(f"record {opcode} inside of the chunk at {at}")
        self._chunks[at] = (chunk, length)
        self._offsets[at] = own

    def _known(self, record, at):
        known = self._schemas if isinstance(record, Schema) else self._channels
        self._expect(known.setdefault(record.id, record) == record, f"{record} differs from an earlier one at {at}")
        if isinstance(record, Channel):
            self._expect(record.schema_id in (0, *self._schemas), f"channel {record.topic} of an unknown schema")

    def _index(self, chunk_at, index):
        for time, offset in index.records:
            found = self._offsets.get(chunk_at, {}).get(offset)
            same = found is not None and (found.channel_id, found.log_time) == (index.channel_id, time)
            self._expect(same, f"message index of the chunk at {chunk_at}")

    def _indexed(self, index):
        chunk, length = self._chunks.get(index.chunk_start_offset, (None, 0))
        if chunk is None:
            self.problems.append(f"index of a chunk that does not exist at {index.chunk_start_offset}")
            return
        self._indexes.append(index.chunk_start_offset)
        stated = (index.chunk_length, index.compressed_size, index.uncompressed_size)
        self._expect(stated == (length, len(chunk.data), chunk.uncompressed_size), "sizes of a chunk index")
        times = (index.message_start_time, index.message_end_time)
        self._expect(times == (chunk.message_start_time, chunk.message_end_time), "times of a chunk index")


def examined(path):
    """Return the doctor of a file."""
    return Doctor(path.read_bytes())
