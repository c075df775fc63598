"""The backends that a study asks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import Kind
    from lsds.plugins.host import PluginHost


def chosen(host: PluginHost, kind: Kind, names: Sequence[str]) -> list[str]:
    """Return the backends of a kind that were asked for; by default all but those that need a model of one's own.

    Raises PluginNotFound, PluginConflict.
    """
    for name in names:
        host.find(kind, name)
    return list(names) or [host.own(kind, name) for name in host.names(kind) if name != "onnx"]
