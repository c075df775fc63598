"""Finding and building backends: one entry-point group, `lsds`, for first and third parties alike."""

from lsds.plugins.host import PluginHost
from lsds.plugins.registry import Backend, PluginFailure, PluginNote
from lsds.plugins.spec import hookimpl

__all__ = ["Backend", "PluginFailure", "PluginHost", "PluginNote", "hookimpl"]
