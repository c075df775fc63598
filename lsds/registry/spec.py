"""The hooks that a plugin may implement, and the decorator that marks the implementation.

A plugin is a module named by an entry point in the group `lsds`:

    [project.entry-points.lsds]
    acme-gripper = "acme_gripper.manifest"

and that module holds

    from lsds.contracts import BackendSpec
    from lsds.registry import hookimpl

    @hookimpl
    def lsds_backends():
        return [BackendSpec("gripper", "acme-2f", "acme_gripper.driver:Gripper", "acme_gripper.driver:Options")]

Hooks are for discovery. None of them is called on the per-frame path.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    from lsds.contracts.backend import BackendSpec

PROJECT = "lsds"
"""Name of the pluggy project and of the entry-point group."""

hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def lsds_backends() -> Sequence[BackendSpec]:  # type: ignore[empty-body]
    """Return the backends this plugin offers.

    Called once per process. It must be fast: name factories as "module:attribute" and import only `lsds`.
    """
