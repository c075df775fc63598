"""A LeRobot dataset v3.0 on disk. It can be read after every episode, whatever ends the export.

Layout and columns are those of https://huggingface.co/docs/lerobot/lerobot-dataset-v3 and of lerobot/datasets/utils.py
in LeRobot 0.4.
Images are stored as recorded, in the rows of the data files: a video would be lossy, and need a codec.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lsds.session.recording.export.lerobot_features import COUNTERS, Feature
from lsds.session.recording.export.lerobot_samples import Sample
from lsds.session.recording.export.lerobot_stats import Statistics
from lsds.support.files import write_whole

VERSION = "v3.0"
PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
FILES_PER_CHUNK = 1000
"""Greatest number of files in a folder `chunk-NNN`."""
DATA_FILE_MB = 100
"""Size at which LeRobot itself begins a new data file; here each episode has its own."""
ROWS_PER_GROUP = 64
"""Frames that are written together: it bounds the memory that an episode takes."""


class LeRobotDataset:
    """A dataset under construction. `episodes` and `frames` count what can be read of it."""

    def __init__(self, folder: Path, features: dict[str, Feature], rate_hz: int, task: str) -> None:
        self.episodes = self.frames = 0
        self._folder, self._features, self._rate_hz, self._task = folder, features, rate_hz, task
        self._statistics = Statistics(features)

    def add(self, samples: Iterable[Sample]) -> int:
        """Write an episode; return the number of its frames. An episode without frames leaves nothing."""
        place = {"chunk_index": self.episodes // FILES_PER_CHUNK, "file_index": self.episodes % FILES_PER_CHUNK}
        own = Statistics(self._features)
        data = self._folder / "data" / f"{PLACE.format(**place)}.parquet"
        frames = self._write_rows(data, samples, own)
        if not frames:
            return 0
        self._statistics.merge(own)
        row = {
            "episode_index": self.episodes,
            "tasks": [self._task],
            "length": frames,
            "data/chunk_index": place["chunk_index"],
            "data/file_index": place["file_index"],
            "dataset_from_index": self.frames,
            "dataset_to_index": self.frames + frames,
            "meta/episodes/chunk_index": place["chunk_index"],
            "meta/episodes/file_index": place["file_index"],
        }
        for name, numbers in own.stated().items():
            row |= {f"stats/{name}/{key}": value for key, value in numbers.items()}
        self._write_table(f"meta/episodes/{PLACE.format(**place)}.parquet", [row])
        self.episodes, self.frames = self.episodes + 1, self.frames + frames
        self._write_task()
        self._write_json("meta/stats.json", self._statistics.stated())
        self._write_json("meta/info.json", self._info())
        return frames

    def _write_rows(self, path: Path, samples: Iterable[Sample], statistics: Statistics) -> int:
        import pyarrow
        import pyarrow.parquet

        path.parent.mkdir(parents=True, exist_ok=True)
        # Readers take every *.parquet in the folder, so a file gets its name when it is whole.
        part = path.with_suffix(".part")
        schema = pyarrow.schema([(name, _arrow(feature)) for name, feature in self._features.items()])
        rows: list[dict[str, Any]] = []
        frames = 0
        try:
            with pyarrow.parquet.ParquetWriter(part, schema) as writer:
                for frames, sample in enumerate(samples, 1):
                    row = self._row(sample, frames - 1)
                    statistics.add(row, frames - 1)
                    rows.append(row)
                    if len(rows) == ROWS_PER_GROUP:
                        writer.write_table(pyarrow.Table.from_pylist(rows, schema=schema))
                        rows = []
                if rows:
                    writer.write_table(pyarrow.Table.from_pylist(rows, schema=schema))
            if frames:
                part.rename(path)
        finally:
            part.unlink(missing_ok=True)
        return frames

    def _row(self, sample: Sample, frame_index: int) -> dict[str, Any]:
        row: dict[str, Any] = {}
        for name, feature in self._features.items():
            if name in COUNTERS:
                continue
            value = sample[name]
            if feature["dtype"] == "image":
                row[name] = {"bytes": value, "path": None}
            else:
                row[name] = value.tolist() if feature["shape"] != [1] else float(value[0])
        return row | {
            "timestamp": frame_index / self._rate_hz,
            "frame_index": frame_index,
            "episode_index": self.episodes,
            "index": self.frames + frame_index,
            "task_index": 0,
        }

    def _write_task(self) -> None:
        """Write the only task. Readers take the text from the index of the table, as pandas stores it."""
        column = {"numpy_type": "int64", "pandas_type": "int64", "metadata": None}
        index = {"numpy_type": "object", "pandas_type": "unicode", "metadata": None}
        stated = {
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [
                {"name": "task_index", "field_name": "task_index", **column},
                {"name": "task", "field_name": "task", **index},
            ],
            "pandas_version": "2.0.0",
        }
        metadata = {"pandas": json.dumps(stated)}
        self._write_table("meta/tasks.parquet", [{"task_index": 0, "task": self._task}], metadata)

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": VERSION,
            "robot_type": "lsds",
            "total_episodes": self.episodes,
            "total_frames": self.frames,
            "total_tasks": 1,
            "chunks_size": FILES_PER_CHUNK,
            "data_files_size_in_mb": DATA_FILE_MB,
            "video_files_size_in_mb": DATA_FILE_MB,
            "fps": self._rate_hz,
            "splits": {"train": f"0:{self.episodes}"},
            "data_path": f"data/{PLACE}.parquet",
            "video_path": None,
            "features": self._features,
        }

    def _write_table(self, name: str, rows: list[dict[str, Any]], metadata: dict[str, str] | None = None) -> None:
        import pyarrow
        import pyarrow.parquet

        buffer = pyarrow.BufferOutputStream()
        found = pyarrow.Table.from_pylist(rows)
        pyarrow.parquet.write_table(found.replace_schema_metadata(metadata), buffer)
        write_whole(self._folder / name, buffer.getvalue().to_pybytes())

    def _write_json(self, name: str, value: Any) -> None:
        write_whole(self._folder / name, json.dumps(value, indent=4).encode())


def _arrow(feature: Feature) -> Any:
    """Return the type of a column: a scalar for one number, a list of fixed length for several."""
    import pyarrow

    if feature["dtype"] == "image":
        return pyarrow.struct([("bytes", pyarrow.binary()), ("path", pyarrow.string())])
    kind = {"float32": pyarrow.float32(), "int64": pyarrow.int64()}[feature["dtype"]]
    return kind if feature["shape"] == [1] else pyarrow.list_(kind, feature["shape"][0])
