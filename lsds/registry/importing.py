"""Import the objects that a manifest names, and check whether the libraries they need are there."""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any

from lsds.errors import PluginLoadError
from lsds.registry.backends import OWN_DISTRIBUTION, Backend
from lsds.registry.containment import one_line
from lsds.registry.loading import upgrade_or_block

if TYPE_CHECKING:
    from pydantic import BaseModel


def imported_target(backend: Backend, target: str) -> Any:
    """Return the object that "module:attribute" names. Raises PluginLoadError, whatever the module raises."""
    module_name, _, attribute = target.partition(":")
    try:
        value: Any = importlib.import_module(module_name)
        for part in attribute.split("."):
            value = getattr(value, part)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise PluginLoadError(
            f"{backend}: importing '{target}' failed: {type(error).__name__}: {one_line(error)}; {remedy_for(backend)}"
        ) from error
    return value


def require_model(backend: Backend, found: object) -> type[BaseModel]:
    """Return the object that `options` names if it is a pydantic model. Raises PluginLoadError."""
    from pydantic import BaseModel

    if isinstance(found, type) and issubclass(found, BaseModel):
        return found
    raise PluginLoadError(
        f"{backend}: options '{backend.spec.options}' is not a pydantic model; derive it from pydantic.BaseModel"
    )


def importable(name: str) -> bool:
    """Return whether a module is installed; a parent package that fails to import counts as missing."""
    try:
        return importlib.util.find_spec(name) is not None
    except KeyboardInterrupt:
        raise
    except BaseException:
        return False


def remedy_for(backend: Backend) -> str:
    """Return what to do about a backend that cannot be imported."""
    if backend.spec.extra:
        return f"install it with: pip install '{backend.distribution}[{backend.spec.extra}]'"
    if backend.distribution == OWN_DISTRIBUTION:
        return "see the documentation of lsds"
    return upgrade_or_block(backend.plugin, backend.distribution)
