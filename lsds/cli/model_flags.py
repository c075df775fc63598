"""Command-line flags made from a pydantic model of options.

A field becomes `--field-name`, with its description as the help. A list field is a repeatable flag, a `Literal` lists
its choices, a bool also gets `--no-...`. `json_schema_extra={"flag": "--scene", "metavar": "NAME"}` sets another flag
and the placeholder of its value in the help; `"writes": True` marks the name of a file that the study writes, which is
then checked before the study starts; `"writes": "folder"` marks a folder, which the study itself makes and checks. The
model itself checks ranges and everything else.
"""

from __future__ import annotations

import types
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin

import click

from lsds.cli.complete import BY_FLAG
from lsds.config.overrides import parse_value

if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic.fields import FieldInfo


def flags(
    model: type[BaseModel] | None, positional: Collection[str] = (), taken: Collection[str] = ()
) -> list[click.Parameter]:
    """Return one parameter per field: an argument for those in `positional`, else an option.

    A field whose name or flag is in `taken` gets none, but can still be set with `--set`.
    """
    fields = {} if model is None else model.model_fields
    found: list[click.Parameter] = []
    used = set(taken)
    for name, field in fields.items():
        if name in positional:
            found.append(click.Argument([name], required=field.is_required()))
            continue
        flag = _flag(name, field)
        if flag not in used and name not in taken:
            used.add(flag)
            found.append(_option(name, flag, field))
    return found


def given(model: type[BaseModel] | None, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options table of the flags that were given."""
    fields = {} if model is None else model.model_fields
    return {
        name: _value(fields[name], value)
        for name, value in values.items()
        if name in fields and value not in (None, ())
    }


def written_files(model: type[BaseModel] | None, options: Mapping[str, Any]) -> list[str]:
    """Return the files that the study will write: the values of fields marked `"writes": True`."""
    fields = {} if model is None else model.model_fields
    names = [name for name, field in fields.items() if _extra(field).get("writes") is True]
    return [str(options[name]) for name in names if options.get(name)]


def written_flags(model: type[BaseModel] | None) -> list[str]:
    """Return the flags of the files that a study can write: those of fields marked `writes`."""
    fields = {} if model is None else model.model_fields
    return [_flag(name, field) for name, field in fields.items() if _extra(field).get("writes")]


def _flag(name: str, field: FieldInfo) -> str:
    return str(_extra(field).get("flag", f"--{name.replace('_', '-')}"))


def _option(name: str, flag: str, field: FieldInfo) -> click.Option:
    kind, repeated = _kind(field)
    help_text = _help(field, repeated)
    if kind is bool and not repeated:
        return click.Option([f"{flag}/--no-{flag.removeprefix('--')}", name], default=None, help=help_text)
    metavar = _extra(field).get("metavar")
    words = _words(kind)
    choice = click.Choice(words) if words else None
    return click.Option(
        [flag, name],
        multiple=repeated,
        default=None,
        type=choice or {int: click.INT, float: click.FLOAT}.get(kind, click.STRING),
        metavar=metavar or (None if choice else "N" if kind in (int, float) else "TEXT"),
        help=help_text,
        required=False,
        shell_complete=None if choice else BY_FLAG.get(flag),
    )


def _kind(field: FieldInfo) -> tuple[Any, bool]:
    """Return the type of one value, and whether several are allowed; None if the value has to be written as TOML."""
    kind = _without_none(field.annotation)
    if get_origin(kind) in (list, set, frozenset) and len(get_args(kind)) == 1:
        return _simple(_without_none(get_args(kind)[0])), True
    return _simple(kind), False


def _simple(kind: Any) -> Any:
    return kind if kind in (bool, int, float, str) or get_origin(kind) is Literal else None


def _without_none(kind: Any) -> Any:
    if get_origin(kind) in (Union, types.UnionType):
        others = [part for part in get_args(kind) if part is not type(None)]
        return others[0] if len(others) == 1 else None
    return kind


def _words(kind: Any) -> list[str]:
    """Return the choices of a Literal as they are typed on the command line, without the empty string."""
    return [str(word) for word in get_args(kind) if str(word)] if get_origin(kind) is Literal else []


def _value(field: FieldInfo, value: Any) -> Any:
    kind, repeated = _kind(field)
    if repeated:
        return [_one(kind, item) for item in value]
    return _one(kind, value)


def _one(kind: Any, value: Any) -> Any:
    if get_origin(kind) is Literal:
        return next(word for word in get_args(kind) if str(word) == value)
    return parse_value(value) if kind is None and isinstance(value, str) else value


def _help(field: FieldInfo, repeated: bool) -> str:
    text = field.description or ""
    if repeated and "repeatable" not in text:
        text += "; repeatable" if text else "repeatable"
    text = text[:1].upper() + text[1:] + ("." if text else "")
    if field.is_required():
        return f"{text}  [required]".strip()
    default = field.get_default(call_default_factory=True)
    if default is None or default == "" or default == [] or isinstance(default, dict):
        return text
    if isinstance(default, bool):
        return text
    shown = ", ".join(map(str, default)) if isinstance(default, list | tuple | set | frozenset) else default
    return f"{text}  [default: {shown}]".strip()


def _extra(field: FieldInfo) -> Mapping[str, Any]:
    return field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
