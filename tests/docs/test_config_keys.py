"""docs/config_keys.md lists every key of a config, and is the one that its script writes."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from lsds.config.model import RigConfig
from lsds.contracts.kinds import CONFIG_KINDS

DOCS = Path(__file__).parents[2] / "docs"
script = runpy.run_path(str(DOCS / "config_keys.py"))


@pytest.fixture(scope="module")
def host():
    return script["first_party"]()


@pytest.fixture(scope="module")
def keys():
    return set(re.findall(r"^\| `([^`]+)` \|", (DOCS / "config_keys.md").read_text(encoding="utf-8"), re.MULTILINE))


def test_the_page_is_the_one_of_the_schema(host):
    stored = (DOCS / "config_keys.md").read_text(encoding="utf-8")
    assert script["page"](host) == stored, "run `python docs/config_keys.py`"


def test_every_section_and_every_option_of_a_backend_is_a_key(host, keys):
    sections = {key.partition(".")[0] for key in keys}
    assert set(RigConfig.model_fields) <= sections | set(CONFIG_KINDS)
    starts = {"fault": "faults[].", "wire_mock": "cell.wire.mocks.{name}."} | {
        k: f"{k}.{{name}}." for k in CONFIG_KINDS
    }
    options = [
        starts[backend.spec.kind].format(name=backend.spec.name) + field
        for backend in host.backends
        if backend.spec.kind in starts and (model := host.options_model(backend))
        for field in model.model_fields
    ]
    assert len(options) > 300
    assert [name for name in options if not any(re.match(re.escape(name) + r"\b", key) for key in keys)] == []


@pytest.mark.parametrize(
    ("key", "cells"),
    [
        ("task.first_squeeze_m", "number in (0, 0.05] | `0.001`"),
        ("task.fragile_n", "number in (0, 500] | not set"),
        ("deadlines.call_s", "number in (0, 3600] | `5.0`"),
        ("arm.backend", '`"none"`, `"mock-ur5e"`, `"ur5e"` | `"mock-ur5e"`'),
        ("pose_source.aruco.boards[].columns", "integer in [2, 100] | required"),
    ],
)
def test_a_row_has_values_and_default(key, cells):
    assert f"| `{key}` | {cells} | " in (DOCS / "config_keys.md").read_text(encoding="utf-8")
