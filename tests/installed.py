"""The first-party plugins, also from a checkout that is not installed."""

from __future__ import annotations

import importlib.util
from importlib.metadata import EntryPoint

from lsds.registry import PluginHost

FIRST_PARTY = ("lsds_plugins", "lsds_drivers", "lsds_mocks", "lsds_research")


def has_manifest(package: str) -> bool:
    return importlib.util.find_spec(package) is not None and importlib.util.find_spec(f"{package}.manifest") is not None


def installed_host() -> PluginHost:
    """Return a host of what is installed, or of the manifests that pyproject.toml names where nothing is."""
    host = PluginHost()
    if host.backends:
        return host
    names = [package for package in FIRST_PARTY if has_manifest(package)]
    return PluginHost(entry_points=[EntryPoint(name.replace("_", "-"), f"{name}.manifest", "lsds") for name in names])
