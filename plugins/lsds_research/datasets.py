"""A columnar dataset: one row per frame, the rows of a recording together and in order of time, and a card.

On disk: a folder with `frames.parquet` and `card.json`. During collection each recording is a file in `parts`, so that
no recording is lost and an interrupted collection can be continued.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds.models.signals import SIGNALS, UNITS
from lsds.support.extras import require
from lsds.support.files import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT = "lsds dataset 1"
FRAMES, CARD, PARTS = "frames.parquet", "card.json", "parts"

KEYS: dict[str, str] = {
    "recording": "str",
    "object": "str",
    "protocol": "str",
    "frame": "int32",
    "t_s": "float64",
}
"""Identification: recording, object, protocol; number of the frame in its recording, its time (s)."""

LABELS: dict[str, str] = {
    "slip": "int8",
    "speed": "float32",
    "velocity_x": "float32",
    "velocity_y": "float32",
    "angular_velocity_label": "float32",
    "slip_true": "int8",
    "speed_true": "float32",
    "velocity_x_true": "float32",
    "velocity_y_true": "float32",
    "angular_velocity_true": "float32",
    "stick_true": "float32",
}
"""Measured labels (`slip` 1, 0, -1 unknown; velocities m/s and rad/s of the object against the gel, in the sensor's
plane), and the simulated truth (NaN or -1 if unknown)."""

COLUMNS: dict[str, str] = {**KEYS, **LABELS, **dict.fromkeys(SIGNALS, "float32")}


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """`columns` by name, all (rows,), and the `card`: what made it (rig, seeds, gels, versions)."""

    columns: Mapping[str, NDArray[Any]]
    card: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.columns["frame"])

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self.columns[name]
        except KeyError:
            raise DataError(f"the dataset has no column '{name}'; it has {', '.join(self.columns)}") from None

    def where(self, rows: NDArray[np.bool_]) -> Dataset:
        """Return the rows that are true, their order kept."""
        return Dataset({name: values[rows] for name, values in self.columns.items()}, self.card)

    def signals(self, names: Sequence[str]) -> NDArray[np.float32]:
        """Return (rows, F): the named signals side by side."""
        return np.stack([self[name] for name in names], axis=1).astype(np.float32, copy=False)

    @property
    def starts(self) -> NDArray[np.intp]:
        """First row of each recording, and the number of rows."""
        names = self["recording"]
        if not len(names):
            return np.zeros(1, np.intp)
        return np.concatenate([[0], np.flatnonzero(names[1:] != names[:-1]) + 1, [len(names)]])

    def save(self, folder: Path) -> None:
        """Write the folder, each file atomically. Raises DataError if a file cannot be written."""
        write_table(self.columns, folder / FRAMES)
        recordings = np.unique(self["recording"])
        card = {**self.card, "format": FORMAT, "rows": len(self), "recordings": len(recordings), "complete": True}
        write_whole(folder / CARD, json.dumps(card, indent=2, sort_keys=True).encode())


def from_rows(
    recording: str,
    object_name: str,
    protocol: str,
    t_s: Sequence[float],
    signals: NDArray[np.float32],
    labels: Mapping[str, NDArray[Any]],
) -> dict[str, NDArray[Any]]:
    """Return the columns of one recording. `signals` (frames, S) in the order of `SIGNALS`; labels that are not given
    are unknown."""
    count = len(t_s)
    columns: dict[str, NDArray[Any]] = {
        "recording": np.full(count, recording, object),
        "object": np.full(count, object_name, object),
        "protocol": np.full(count, protocol, object),
        "frame": np.arange(count, dtype=np.int32),
        "t_s": np.asarray(t_s, np.float64),
    }
    for name, kind in LABELS.items():
        given = labels.get(name)
        unknown = -1 if kind == "int8" else np.nan
        columns[name] = np.full(count, unknown, kind) if given is None else np.asarray(given, kind)
    for index, name in enumerate(SIGNALS):
        columns[name] = np.asarray(signals[:, index], np.float32)
    return columns


def joined(parts: Sequence[Mapping[str, NDArray[Any]]], card: Mapping[str, Any]) -> Dataset:
    """Return one dataset of recordings' columns, in the order given."""
    if not parts:
        raise DataError("no recordings: there is nothing to make a dataset of")
    return Dataset({name: np.concatenate([part[name] for part in parts]) for name in COLUMNS}, card)


def merged(parts: Sequence[tuple[str, Dataset]]) -> Dataset:
    """Return one dataset of several, by their names. Recordings of the same name stay separate; the card holds the
    common settings, and of each dataset its job, labels, overrides and seed.

    Raises DataError if a recording is in two of them.
    """
    if len(parts) == 1:
        return parts[0][1]
    columns, taken, seen = [], set[str](), dict[bytes, str]()
    for name, part in parts:
        recordings = part["recording"]
        for begin, end in pairwise(part.starts):
            digest = _digest(part, slice(begin, end))
            if digest in seen:
                raise DataError(f"{name}: recording {recordings[begin]} is the same as one of {seen[digest]}")
            seen[digest] = name
        if taken & set(recordings.tolist()):
            recordings = np.array([f"{name}/{each}" for each in recordings], object)
        taken |= set(recordings.tolist())
        columns.append({**part.columns, "recording": recordings})
    cards = [part.card for _, part in parts]
    first = {key: cards[0][key] for key in ("rig", "quick") if key in cards[0]}
    card = {key: value for key, value in first.items() if all(own.get(key) == value for own in cards)}
    origins = {str(own.get("figures_are", "of unknown origin")) for own in cards}
    return joined(
        columns,
        {
            **card,
            "figures_are": " and ".join(sorted(origins, reverse=True)),
            "job": ", ".join(dict.fromkeys(str(own.get("job")) for own in cards)),
            "datasets": {
                name: {key: part.card.get(key) for key in ("job", "labels", "overrides", "seed")}
                for name, part in parts
            },
        },
    )


def _digest(data: Dataset, rows: slice) -> bytes:
    """Return a digest of a recording's times and signals, to find duplicates."""
    digest = hashlib.sha256(np.ascontiguousarray(data["t_s"][rows]).tobytes())
    for name in SIGNALS:
        digest.update(np.ascontiguousarray(data[name][rows]).tobytes())
    return digest.digest()


def load(folder: Path) -> Dataset:
    """Read a dataset. Raises DataError if it is missing, truncated, lacks a column or has invalid values."""
    path = folder / FRAMES
    card = read_card(folder)
    if card is None:
        raise DataError(f"{folder}: no dataset there, for it has no {CARD} (lsds learn collect makes one)")
    if card.get("format") != FORMAT:
        raise DataError(f"{folder / CARD}: not the card of an '{FORMAT}'; collect it again")
    if not card.get("complete", False):
        raise DataError(f"{folder}: its collection was not finished (go on: lsds learn collect, same --out)")
    columns = read_table(path)
    _check(path, columns)
    if card.get("rows") != len(columns["frame"]):
        raise DataError(f"{path}: {len(columns['frame'])} rows, but its card says {card.get('rows')}: it was cut short")
    return Dataset(columns, card)


def read_card(folder: Path) -> dict[str, Any] | None:
    """Return a folder's dataset card, or None without one. Raises DataError for an invalid card."""
    path = folder / CARD
    try:
        card = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except NotADirectoryError as error:
        raise DataError(f"{folder}: is a file; name the folder of the dataset that it is in") from error
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: not a dataset's card: {error}") from error
    if not isinstance(card, dict):
        raise DataError(f"{path}: not a dataset's card, for it holds no table (choose another folder)")
    return card


def _check(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    missing = [name for name in COLUMNS if name not in columns]
    if missing:
        raise DataError(f"{path}: column{'s' * (len(missing) > 1)} {', '.join(missing)} missing")
    for name, kind in COLUMNS.items():
        own = columns[name].dtype.kind
        text = all(isinstance(value, str) for value in columns[name]) if own == "O" else False
        if text != (kind == "str") or (not text and own not in ("iu" if kind.startswith("int") else "iuf")):
            raise DataError(f"{path}: column {name} holds {columns[name].dtype}, not {kind}")
    if not np.isfinite(columns["t_s"]).all():
        raise DataError(f"{path}: column t_s is not finite in row {int(np.argmin(np.isfinite(columns['t_s'])))}")
    names, t_s = columns["recording"], columns["t_s"]
    same = names[1:] == names[:-1]
    if np.count_nonzero(~same) + 1 != len(np.unique(names)) and len(names):
        raise DataError(f"{path}: rows of a recording are not together in column recording")
    back = np.flatnonzero(same & (np.diff(t_s) < 0))
    if len(back):
        raise DataError(f"{path}: column t_s goes back in row {int(back[0]) + 1}, within recording {names[back[0]]}")
    for name in ("slip", "slip_true"):
        if not np.isin(columns[name], (-1, 0, 1)).all():
            raise DataError(f"{path}: column {name} holds something else than 1 (slip), 0 (none) and -1 (unknown)")


def write_table(columns: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Write columns as Parquet, atomically, with their units. Raises DataError."""
    arrow, parquet = require_arrow()
    units = {name.encode(): UNITS[name].encode() for name in columns if name in UNITS}
    table = arrow.table({name: arrow.array(values) for name, values in columns.items()})
    table = table.replace_schema_metadata({b"format": FORMAT.encode(), **units})
    sink = arrow.BufferOutputStream()
    parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    write_whole(path, sink.getvalue().to_pybytes())


def read_table(path: Path) -> dict[str, NDArray[Any]]:
    """Read columns from Parquet. Raises DataError if the file is missing, damaged, or in other units."""
    arrow, parquet = require_arrow()
    try:
        table = parquet.read_table(path, page_checksum_verification=True)
        names = table.column_names
        stored_units = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    except (OSError, arrow.ArrowException, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read as Parquet: {str(error).partition(chr(10))[0]}") from error
    for name in names:
        if name in UNITS and stored_units.get(name, UNITS[name]) != UNITS[name]:
            raise DataError(f"{path}: column {name} is in {stored_units[name]}, not in {UNITS[name]}")
        if table[name].null_count:
            raise DataError(f"{path}: column {name} has holes (what is unknown is NaN or -1 there, never left out)")
    return {
        name: np.array(table[name].to_pylist(), object) if COLUMNS.get(name) == "str" else table[name].to_numpy()
        for name in names
    }


def require_arrow() -> tuple[Any, Any]:
    """Return pyarrow and its Parquet module. Raises MissingExtra where they are not installed."""
    require("pyarrow", extra="data", purpose="a dataset")
    import pyarrow
    import pyarrow.parquet as parquet

    return pyarrow, parquet
