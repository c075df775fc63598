"""Modules that moved can be imported by their former names for one release."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from lsds.support.former_names import MOVED, present_name


@pytest.mark.parametrize("name", MOVED)
def test_a_former_name_gives_the_module_of_today(name):
    sys.modules.pop(name, None)
    with pytest.warns(DeprecationWarning, match=f"'{name}' is now '{MOVED[name]}'"):
        module = importlib.import_module(name)
    now = importlib.import_module(MOVED[name])
    assert module is now
    assert now.__spec__.name == now.__name__ == MOVED[name]


def test_a_plugin_of_before_gets_the_same_classes():
    code = (
        "from lsds.registry import PluginHost, hookimpl; from lsds.registry.host import PluginHost as Other;"
        "from lsds.registry.host import PluginHost as Now; from lsds.contracts.plant import join;"
        "from lsds.contracts.lifecycle import LifecycleGuard; from lsds.calibration.vision.camera import CameraModel;"
        "assert PluginHost is Other is Now; print('same')"
    )
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "same\n"


@pytest.mark.parametrize("name", ["lsds.nowhere", "lsds.runtime.engine", "numpy", "lsds.nowhere.at_all"])
def test_other_names_are_not_former_ones(name):
    assert present_name(name) == ""
