"""The stream of a topic as a table: one row per message, one column per field, SI units in the metadata.

`now_ns` is when the engine knew the message and `t_ns` when its content was true, on the rig's clock.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError, MissingExtra
from lsds.session.recording.export.content import content
from lsds.session.recording.export.flatten import flattened, unit_of, without_text
from lsds.session.recording.export.kinds import Columns, Kind
from lsds.session.recording.reader import Recording
from lsds.support.extras import importable, require

if TYPE_CHECKING:
    import pandas
    import pyarrow

    from lsds.session.recording.reader import Raw

TIMES: dict[str, Kind] = {"now_ns": "int64", "t_ns": "int64"}
"""The first columns of every table: the two times of the message (ns)."""


def frame(path: str | Path, topic: str) -> pandas.DataFrame:
    """Return the stream of a topic as a pandas DataFrame; `df.attrs["units"]` holds the units by column.

    Raises MissingExtra without pandas or pyarrow, DataError for an unknown topic or a file that is no recording.
    """
    if not importable("pandas"):
        raise MissingExtra("a DataFrame needs pandas, which is not installed; install with: pip install pandas")
    found = table(path, topic)
    data = found.to_pandas()
    data.attrs["units"] = {field.name: units[b"unit"].decode() for field in found.schema if (units := field.metadata)}
    return data


def table(path: str | Path, topic: str) -> pyarrow.Table:
    """Return the stream of a topic as a pyarrow table. Raises MissingExtra, DataError."""
    require("pyarrow", extra="data", purpose="a table")
    import pyarrow

    recording = Recording(path)
    rows, topics, columns = [], set(), None
    for raw in recording.messages():
        topics.add(raw.topic)
        if raw.topic == topic:
            columns = columns or Columns(recording.schemas.get(raw.schema, b""))
            rows.append(row_of(raw, recording.path))
            columns.see(rows[-1])
    if columns is None:
        raise DataError(f"{path}: no topic '{topic}' (there are {', '.join(sorted(topics))})")
    return pyarrow.Table.from_pylist(fitted(rows, kinds_of(columns)), schema=schema_of_table(kinds_of(columns)))


def row_of(raw: Raw, path: Path) -> dict[str, Any]:
    """Return a message as a row. Its own `now_ns` and `t_ns` are those of the message. Raises DataError."""
    return flattened(content(raw, path)) | {"now_ns": raw.now_ns, "t_ns": raw.t_ns}


def kinds_of(columns: Columns) -> dict[str, Kind]:
    """Return the kinds of all columns, the times first."""
    return TIMES | columns.kinds() | TIMES


def fitted(rows: list[dict[str, Any]], kinds: Mapping[str, Kind]) -> list[dict[str, Any]]:
    """Return rows whose values have the kinds of their columns."""
    return [{name: _fitted(row.get(name), kind) for name, kind in kinds.items()} for row in rows]


def schema_of_table(kinds: Mapping[str, Kind]) -> pyarrow.Schema:
    """Return the schema of a table; the metadata `unit` of a column is its SI unit."""
    import pyarrow

    fields = []
    for name, kind in kinds.items():
        unit = unit_of(name) if _is_number(kind) else ""
        fields.append(pyarrow.field(name, _arrow(kind), metadata={"unit": unit} if unit else None))
    return pyarrow.schema(fields)


def _fitted(value: Any, kind: Kind) -> Any:
    if kind == "string" and value is not None and not isinstance(value, str):
        return json.dumps(value)
    return without_text(value) if _is_number(kind) else value


def _is_number(kind: Kind) -> bool:
    return _is_number(kind[1]) if isinstance(kind, tuple) else kind in ("int64", "double")


def _arrow(kind: Kind) -> Any:
    import pyarrow

    if isinstance(kind, tuple):
        return pyarrow.list_(_arrow(kind[1]))
    return {
        "bool": pyarrow.bool_(),
        "int64": pyarrow.int64(),
        "double": pyarrow.float64(),
        "string": pyarrow.string(),
        "binary": pyarrow.binary(),
    }[kind]
