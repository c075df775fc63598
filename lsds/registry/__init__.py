"""Finding and building backends: one entry-point group, `lsds`, for first and third parties alike."""

from lsds.registry.backends import Backend, PluginFailure, PluginNote
from lsds.registry.host import PluginHost
from lsds.registry.spec import hookimpl

__all__ = ["Backend", "PluginFailure", "PluginHost", "PluginNote", "hookimpl"]
