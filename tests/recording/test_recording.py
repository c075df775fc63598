"""A recording holds the run, whatever ends it, and touches no other file."""

from __future__ import annotations

import dataclasses
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter

import numpy as np
import pytest

from lsds import __version__
from lsds.errors import ConfigError, DataError
from lsds.registry import PluginHost
from lsds.session.recording.files import contents, cut, repair
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter
from lsds.session.replay import replayed_config
from lsds.session.run import run
from tests.recording.conftest import SHORT


def test_a_recorded_run_is_the_same_run(recorded):
    path, session = recorded
    plain = run(None, SHORT)
    assert session.summary["recording"] == {
        "file": str(path),
        "messages": sum(1 for _ in Recording(path).messages()),
        "events": session.summary["recording"]["events"],
        "lost": 0,
        "problem": "",
    }
    assert plain.summary["recording"] is None
    for name in ("outcome", "slip_distance_m", "steady_normal_force_n", "cycles", "corrections"):
        assert plain.summary[name] == session.summary[name]


def test_every_stream_is_there_at_its_own_rate(recorded):
    path, session = recorded
    found = contents(path)
    assert found["damage"] == ""
    assert found["simulated"]
    topics = found["topics"]
    assert topics["/cycle"]["messages"] == session.summary["cycles"]
    assert topics["/finger/finger/image"]["rate_hz"] == pytest.approx(25, abs=2)
    assert topics["/gripper/state"]["rate_hz"] == pytest.approx(100, abs=5)
    assert topics["/finger/finger/image"]["schema"] == "foxglove.CompressedImage"
    assert topics["/arm/tcp"]["schema"] == "foxglove.PoseInFrame"
    assert {"/truth", "/job", "/grip", "/finger/finger/tracks", "/finger/finger/features"} <= set(topics)


def test_images_are_recorded_without_loss(tmp_path):
    path = tmp_path / "run.mcap"
    seen = {}
    run(None, SHORT, record=path, observe=lambda cycle: seen.update({cycle.frame.seq: cycle.frame}))
    stored = {frame.seq: frame for _, frame in Recording(path).frames()}
    assert set(seen) <= set(stored)
    for seq, frame in seen.items():
        np.testing.assert_array_equal(stored[seq].image, frame.image)
        assert stored[seq].t_ns == frame.t_ns


def test_other_peoples_readers_read_it(recorded):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    path, _ = recorded
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        counts = Counter(channel.topic for _, channel, _ in reader.iter_messages())
        assert counts == {name: own["messages"] for name, own in contents(path)["topics"].items()}
        kinds = ["/finger/finger/image", "/arm/tcp", "/gripper/joints"]
        for schema, channel, _, value in reader.iter_decoded_messages(topics=kinds):
            assert value.DESCRIPTOR.full_name == schema.name, channel.topic
            assert value.timestamp.seconds >= 0


def test_a_whole_recording_holds_the_summary_of_its_run(recorded, tmp_path):
    path, session = recorded
    mended = tmp_path / "mended.mcap"
    repair(path, mended)
    for source in (path, mended):
        recording = Recording(source)
        assert recording.summary is None
        list(recording.messages())
        assert recording.summary["outcome"] == session.summary["outcome"] == "held"
        assert recording.summary["slip_distance_m"] == session.summary["slip_distance_m"]


@pytest.mark.parametrize("share", np.linspace(0.02, 0.999, 20))
def test_a_file_that_ends_anywhere_reads_up_to_there(recorded, tmp_path, share):
    path, _ = recorded
    whole = list(Recording(path).messages())
    short = tmp_path / "short.mcap"
    short.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    recording = Recording(short)
    part = list(recording.messages())
    assert recording.damage
    assert part == whole[: len(part)]
    if part:
        mended = tmp_path / "mended.mcap"
        written, damage = repair(short, mended)
        assert (written, bool(damage)) == (len(part), True)
        assert contents(mended)["damage"] == ""
        assert [m.data for m in Recording(mended).messages()] == [m.data for m in part]


def test_a_damaged_byte_ends_the_file_there_and_raises_nothing(recorded, tmp_path):
    path, _ = recorded
    rng = np.random.default_rng(0)
    data = path.read_bytes()
    broken = tmp_path / "broken.mcap"
    read = []
    for at in rng.integers(3000, len(data), 15):
        changed = bytearray(data)
        changed[at] ^= 0xFF
        broken.write_bytes(changed)
        recording = Recording(broken)
        read.append(sum(1 for _ in recording.messages()))
    assert max(read) > 100


def test_a_chunk_that_cannot_be_decompressed_ends_the_file_there_and_raises_nothing(recorded, tmp_path):
    data = recorded[0].read_bytes()
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(data.replace(b"\x28\xb5\x2f\xfd", bytes(4)))  # the magic number of Zstandard frames
    recording = Recording(broken)
    assert list(recording.messages()) == []
    assert "ZstdError" in recording.damage


@pytest.mark.parametrize("content", [b"", b"not a recording", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_recording_is_refused(tmp_path, content):
    path = tmp_path / "other.mcap"
    path.write_bytes(content)
    with pytest.raises(DataError, match="not a recording of lsds"):
        Recording(path)


def test_no_file_is_overwritten_and_nothing_moves_without_a_recording(recorded, tmp_path):
    path, _ = recorded
    before = path.read_bytes()
    cycles = []
    with pytest.raises(DataError, match="exists already"):
        run(None, SHORT, record=path, observe=cycles.append)
    with pytest.raises(DataError, match="no folder"):
        run(None, SHORT, record=tmp_path / "missing" / "run.mcap", observe=cycles.append)
    assert not cycles
    assert path.read_bytes() == before


def test_without_room_at_the_start_the_run_does_not_begin(tmp_path, monkeypatch):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage._replace(free=1_000_000))
    with pytest.raises(DataError, match="only 1 MB are free"):
        run(None, SHORT, record=tmp_path / "run.mcap")


class FullDisk:
    """A file that takes so many bytes."""

    def __init__(self, file, room):
        self._file, self._room, self.raw = file, room, file.raw

    def write(self, data):
        if self._file.tell() + len(data) > self._room:
            raise OSError(28, "No space left on device")
        return self._file.write(data)

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.mark.parametrize("room", [20_000, 200_000, 1_500_000])
def test_a_full_disk_ends_the_recording_and_not_the_run(tmp_path, monkeypatch, room):
    from lsds.session.recording import writer

    created = writer._created
    monkeypatch.setattr(writer, "_created", lambda path: FullDisk(created(path), room))
    path = tmp_path / "run.mcap"
    session = run(None, SHORT, record=path)
    assert session.summary["outcome"] == "held"
    assert "No space left" in session.summary["recording"]["problem"]
    recording = Recording(path)
    assert path.stat().st_size <= room
    assert sum(1 for _ in recording.messages()) >= 0
    assert "EndOfFile" in recording.damage


def test_a_process_that_is_killed_loses_less_than_a_second(tmp_path):
    """The frames that are in the file when the process is killed, against those that it had published."""
    path, published = tmp_path / "run.mcap", tmp_path / "published.txt"
    code = f"""
        from lsds.session.run import run
        with open({str(published)!r}, "w", buffering=1) as file:
            run(None, ["seed=5", "task.hold_s=100"], record={str(path)!r},
                observe=lambda cycle: print(cycle.frame.seq, __import__("time").monotonic(), file=file))
    """
    for wait_s in (0.4, 0.9, 1.7):
        path.unlink(missing_ok=True)
        published.unlink(missing_ok=True)
        process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)])
        try:
            deadline = time.monotonic() + 60
            while (not published.exists() or not published.stat().st_size) and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(wait_s)
        finally:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
        lines = [line.split() for line in published.read_text().splitlines() if line.endswith(tuple("0123456789"))]
        times = {int(line[0]): float(line[1]) for line in lines if len(line) == 2}
        stored = [frame.seq for _, frame in Recording(path).frames()]
        lost = [times[seq] for seq in times if seq > max(stored, default=-1)]
        assert stored
        assert not lost or max(times.values()) - min(lost) < 1.0


def test_a_part_is_cut_out(recorded, tmp_path):
    path, _ = recorded
    part = tmp_path / "part.mcap"
    cut(path, part, 1.0, 2.0)
    begin = Recording(path).header.started_ns
    times = [(message.now_ns - begin) * 1e-9 for message in Recording(part).messages()]
    assert 1.0 <= min(times) < 1.05
    assert 1.95 < max(times) <= 2.0
    with pytest.raises(DataError, match="is empty"):
        cut(path, tmp_path / "none.mcap", 3.0, 2.0)
    with pytest.raises(DataError, match="no message"):
        cut(path, tmp_path / "none.mcap", 1000.0)
    with pytest.raises(DataError, match="recording itself"):
        repair(part, part)


def test_the_header_names_the_version_of_lsds_by_its_prefix(recorded):
    header = Recording(recorded[0]).header
    assert header.lsds == __version__
    assert "lsds-tactile" not in header.versions


@pytest.mark.parametrize("prefix", ["lsds", "lsds-tactile"])
def test_a_header_with_either_name_of_lsds_is_read(recorded, tmp_path, prefix):
    header = Recording(recorded[0]).header
    config = header.config.replace('backend = "fused"', f'backend = "{prefix}:fused"')
    assert config != header.config
    old = dataclasses.replace(header, versions={"python": "3.11.0", prefix: "0.1.0"}, config=config)
    path = tmp_path / "old.mcap"
    RecordingWriter(path, old).close()
    found = Recording(path).header
    assert found == old
    assert replayed_config(found, path, (), PluginHost()).detector.backend == f"{prefix}:fused"


def test_a_newer_format_is_refused_with_the_remedy(recorded, tmp_path):
    path, _ = recorded
    header = Recording(path).header
    newer = tmp_path / "newer.mcap"
    RecordingWriter(newer, dataclasses.replace(header, format=99)).close()
    with pytest.raises(DataError, match=r"format 99.*install a newer"):
        Recording(newer)


def test_reruns_reader_finds_every_stream(recorded):
    pytest.importorskip("rerun", reason="needs the extra view")
    from rerun.chunk import McapReader

    path, _ = recorded
    rows: Counter[str] = Counter()
    for chunk in McapReader(str(path)).stream():
        rows[chunk.entity_path] += chunk.num_rows
    for name, own in contents(path)["topics"].items():
        # A channel's description is a row too.
        assert own["messages"] <= rows[name] <= own["messages"] + 1


def test_a_run_that_does_not_begin_leaves_no_recording(tmp_path):
    path = tmp_path / "run.mcap"
    for broken in ({"view": "televison"}, {"view": str(tmp_path / "missing" / "v.rrd")}):
        with pytest.raises(DataError):
            run(None, SHORT, record=path, **broken)
        assert not path.exists()
    with pytest.raises(ConfigError, match="fragile"):
        run(None, [*SHORT, "task.fragile_n=5.0", "controller.backend=pd"], record=path)
    assert not path.exists()


def test_a_part_states_its_own_length(recorded, tmp_path):
    part = tmp_path / "part.mcap"
    cut(recorded[0], part, 1.0, 2.0)
    found = contents(part)
    assert found["begins_s"] == pytest.approx(1.0, abs=0.05)
    assert found["duration_s"] == pytest.approx(1.0, abs=0.05)


def test_a_copy_that_fails_leaves_no_file(recorded, tmp_path, monkeypatch):
    from lsds.session.recording import writer

    created = writer._created
    monkeypatch.setattr(writer, "_created", lambda path: FullDisk(created(path), 50_000))
    with pytest.raises(DataError, match="No space left"):
        repair(recorded[0], tmp_path / "copy.mcap")
    assert not (tmp_path / "copy.mcap").exists()


def test_a_summary_without_a_form_does_not_cost_the_end_of_the_file(recorded, tmp_path):
    path = tmp_path / "odd.mcap"
    odd = RecordingWriter(path, Recording(recorded[0]).header)
    odd.summary = {"odd": {1, 2}}
    with pytest.raises(DataError, match="has no summary: set"):
        odd.close()
    assert contents(path)["damage"] == ""
