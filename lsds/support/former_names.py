"""Former names of modules, which plugins of the last release may import. The next minor release removes them."""

from __future__ import annotations

import sys

# `import lsds` reads this module: what takes time is imported when it is used.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

MOVED = {
    "lsds.actuation": "lsds.runtime.actuation",
    "lsds.engine": "lsds.runtime.engine",
    "lsds.extras": "lsds.support.extras",
    "lsds.files": "lsds.support.files",
    "lsds.lifecycle": "lsds.contracts.lifecycle",
    "lsds.plant": "lsds.contracts.plant",
    "lsds.plugins": "lsds.registry",
    "lsds.plugins.registry": "lsds.registry.backends",
    "lsds.processes": "lsds.support.processes",
    "lsds.rig": "lsds.runtime.rig",
    "lsds.scheduler": "lsds.runtime.scheduler",
    "lsds.stages": "lsds.contracts.stages",
    "lsds.task": "lsds.contracts.task",
    "lsds.tracking": "lsds.session.track",
    "lsds.vision": "lsds.calibration.vision",
}
"""Former name of a module or package -> its present name."""


def present_name(name: str) -> str:
    """Return the present name of a module, or an empty string if the name is no former one."""
    if name in MOVED:
        return MOVED[name]
    package, _, module = name.rpartition(".")
    return f"{MOVED[package]}.{module}" if package in MOVED else ""


class FormerNames:
    """An import finder and loader: a former name gives the module of today, with a DeprecationWarning."""

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        """Return the spec of a former name, None for any other."""
        if not name.startswith("lsds.") or not present_name(name):
            return None
        from importlib.machinery import ModuleSpec

        return ModuleSpec(name, self)  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module of today."""
        import importlib
        import warnings

        now = present_name(spec.name)
        warnings.warn(f"'{spec.name}' is now '{now}'; import that", DeprecationWarning, stacklevel=2)
        module = importlib.import_module(now)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Restore the spec of the module of today, which the import system replaced. Nothing is executed."""
        if module.__spec__ is not None:
            module.__spec__ = module.__spec__.loader_state


def install() -> None:
    """Let former names be imported. A second call does nothing."""
    # In front of the others: a former package has a path, in which the usual finder would load its modules once more.
    if not any(isinstance(finder, FormerNames) for finder in sys.meta_path):
        sys.meta_path.insert(0, FormerNames())
