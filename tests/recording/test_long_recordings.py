"""A recording takes no more memory the longer it is, and its index can still be used at its end."""

from __future__ import annotations

import tracemalloc

from mcap.reader import make_reader

from lsds.session.recording.files import contents
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter

CHUNKS = 400
MOST_BYTES = 450
"""Greatest memory that a chunk may leave behind, bytes: its entry in the index has some 300."""


def test_a_chunk_leaves_only_its_entry_of_the_index_in_memory(recorded, tmp_path):
    source = Recording(recorded[0])
    # One message of each topic fills a chunk with as many channels as a real one has.
    messages = list({message.topic: message for message in source.messages()}.values())
    writer = RecordingWriter(tmp_path / "long.mcap", source.header)

    def chunks(count):
        for _ in range(count):
            for message in messages:
                writer.copy(message, source.schemas[message.schema])
            writer._flush()

    chunks(20)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    chunks(CHUNKS)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    writer.close()
    assert grown / CHUNKS < MOST_BYTES


def test_the_index_names_every_chunk_and_finds_a_topic(recorded):
    path, _ = recorded
    topics = contents(path)["topics"]
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 3
        assert all(index.message_index_offsets for index in summary.chunk_indexes)
        assert sum(1 for _ in reader.iter_messages(topics=["/cycle"])) == topics["/cycle"]["messages"]
