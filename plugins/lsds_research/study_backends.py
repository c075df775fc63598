"""The backends that a study compares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel

if TYPE_CHECKING:
    from lsds.contracts import Kind
    from lsds.registry.host import PluginHost


M = TypeVar("M", bound=BaseModel)


def backend_names(host: PluginHost, kind: Kind, names: Sequence[str]) -> list[str]:
    """Return the named backends of a kind, or by default all that need no model file.

    Raises PluginNotFound, PluginConflict.
    """
    for name in names:
        host.find(kind, name)
    return list(names) or [host.own(kind, name) for name in host.names(kind) if name != "onnx"]


def with_own_defaults(host: PluginHost, options: M, kinds: Mapping[str, Kind]) -> M:
    """Return the options, with "lsds:name" for each default backend whose name another plugin claims too.

    `kinds` maps fields, which are lists of backend names, to the kinds of the backends.
    """
    defaults = {field: kind for field, kind in kinds.items() if field not in options.model_fields_set}
    own = {field: [host.own(kind, name) for name in getattr(options, field)] for field, kind in defaults.items()}
    return options.model_copy(update=own)
