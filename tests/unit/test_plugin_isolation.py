"""A broken plugin never affects the others: a table of mistakes, each with one line of what, where and remedy."""

from __future__ import annotations

import json
import os
import sys
import warnings
from types import SimpleNamespace

import pytest
from fake_cell import plugin
from plugin_mistakes import BUILT, REFUSED, TOLERATED, Named

from lsds.cli import plugins as plugins_module
from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import check_config, json_schema
from lsds.contracts import BackendSpec, BuildContext
from lsds.errors import ConfigError, PluginError
from lsds.registry import PluginHost

GOOD = BackendSpec("gripper", "good", "fake_cell:FakeGripper", "fake_cell:Options", virtual_time=True)


def context():
    return BuildContext(VirtualClock())


def good(name="good", distribution="good-dist"):
    return SimpleNamespace(name=name, dist=SimpleNamespace(name=distribution), load=lambda: plugin(GOOD))


@pytest.fixture
def with_bad(tmp_path, monkeypatch):
    """Return a host of a plugin with this source, between two that are fine."""
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.startswith("bad_")]:
        monkeypatch.delitem(sys.modules, name)

    def make(source, driver=""):
        (tmp_path / "bad_manifest.py").write_text(source)
        (tmp_path / "bad_driver.py").write_text(driver)
        entry_points = [good("first", "first-dist"), Named("bad", "bad_manifest", "lsds"), good("last")]
        return PluginHost(entry_points=entry_points)

    yield make
    for name in [name for name in sys.modules if name.startswith("bad_")]:
        del sys.modules[name]


def works(host):
    """Check that the other plugins are listed, build and have a schema."""
    assert host.build("gripper", "first:good", {}, context())
    assert host.build("gripper", "last:good", {}, context())
    assert "good" in json_schema(host)["properties"]["gripper"]["properties"]


@pytest.mark.parametrize("mistake", REFUSED)
def test_a_plugin_that_is_refused(mistake, with_bad, monkeypatch, capsys):
    source, problem, remedy = REFUSED[mistake]
    host = with_bad(source)
    (failure,) = host.failures
    assert (failure.plugin, failure.distribution) == ("bad", "bad-dist")
    assert problem in failure.reason
    assert remedy in failure.remedy
    assert "\n" not in str(failure)
    assert [backend.plugin for backend in host.backends] == ["first", "last"]
    works(host)
    monkeypatch.setattr(plugins_module, "PluginHost", lambda: host)
    assert main(["plugins"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "failed to load" in line]
    assert line.startswith("plugin bad (bad-dist): failed to load: ")
    assert line.endswith(failure.remedy)


@pytest.mark.filterwarnings("ignore:x:UserWarning")
@pytest.mark.parametrize("manners", TOLERATED)
def test_a_plugin_with_bad_manners(manners, with_bad, capsys):
    before = sys.stdout, sys.stderr, os.getcwd(), list(warnings.filters)
    host = with_bad(TOLERATED[manners])
    assert host.failures == ()
    assert [backend.plugin for backend in host.backends] == ["bad", "first", "last"]
    assert (sys.stdout, sys.stderr, os.getcwd(), list(warnings.filters)) == before
    assert host.build("gripper", "bad", {}, context())
    works(host)
    print("printed")
    assert capsys.readouterr().out == "printed\n"


@pytest.mark.parametrize("mistake", BUILT)
def test_a_backend_that_cannot_be_built(mistake, with_bad):
    driver, problem, remedy = BUILT[mistake]
    options = ", 'bad_driver:Options'" if "options" in mistake else ", 'fake_cell:Options'"
    host = with_bad(
        "from lsds.contracts import BackendSpec\nfrom lsds.registry import hookimpl\n@hookimpl\n"
        f"def lsds_backends():\n    return [BackendSpec('gripper', 'bad', 'bad_driver:Thing'{options})]",
        driver,
    )
    assert host.failures == ()
    with pytest.raises(PluginError) as caught:
        host.build("gripper", "bad", {}, context())
    message = str(caught.value)
    assert message.startswith("gripper 'bad' of bad-dist")
    assert problem in message
    assert remedy in message
    assert "\n" not in message
    works(host)


def test_an_interrupt_is_no_mistake_of_a_plugin(with_bad):
    with pytest.raises(KeyboardInterrupt):
        _ = with_bad("raise KeyboardInterrupt").backends
    host = PluginHost(entry_points=[])

    def interrupted(options, ctx):
        raise KeyboardInterrupt

    sys.modules["bad_interrupt"] = SimpleNamespace(make=interrupted)
    host.register(plugin(BackendSpec("gripper", "g", "bad_interrupt:make")), distribution="d")
    with pytest.raises(KeyboardInterrupt):
        host.build("gripper", "g", {}, context())


def test_two_entry_points_for_one_module():
    entry = good("a", "dist")
    offered = entry.load()
    same = [SimpleNamespace(name=name, dist=entry.dist, load=lambda: offered) for name in ("a", "b")]
    host = PluginHost(entry_points=same)
    assert [backend.plugin for backend in host.backends] == ["a"]
    assert "installed twice" in str(host.failures[0])


def test_a_distribution_without_metadata():
    class Damaged:
        @property
        def name(self):
            raise FileNotFoundError("METADATA")

    entry = SimpleNamespace(name="odd", dist=Damaged(), load=lambda: plugin(GOOD))
    host = PluginHost(entry_points=[entry])
    assert host.find("gripper", "good").distribution == "unknown"


@pytest.mark.parametrize("content", [b"\xff\xfe", b"[lsds]\nno equals sign\n"])
def test_a_distribution_whose_entry_points_cannot_be_read(content, tmp_path, monkeypatch):
    before = [(backend.spec.kind, backend.qualified_name) for backend in PluginHost().backends]
    folder = tmp_path / "damaged_dist-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: damaged-dist\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_bytes(content)
    monkeypatch.syspath_prepend(str(tmp_path))
    host = PluginHost()
    assert [(backend.spec.kind, backend.qualified_name) for backend in host.backends] == before
    (failure,) = host.failures
    assert failure.distribution == "damaged-dist"
    assert "its entry points cannot be read" in failure.reason
    assert failure.remedy == "install it again: pip install --force-reinstall damaged-dist"


def test_a_required_package_that_cannot_be_imported(tmp_path, monkeypatch, capsys):
    (tmp_path / "bad_parent").mkdir()
    (tmp_path / "bad_parent" / "__init__.py").write_text("print('loud')\nraise SystemExit(1)")
    monkeypatch.syspath_prepend(str(tmp_path))
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("gripper", "g", "m:a", requires=("bad_parent.child",))), distribution="d")
    assert host.missing_requirements(host.find("gripper", "g")) == ("bad_parent.child",)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "hint"), [("last-dst", "did you mean 'last-dist'?"), ("something-else", "check the name")]
)
def test_a_blocked_name_that_does_not_exist(name, hint, monkeypatch, capsys):
    monkeypatch.setenv("LSDS_BLOCK_PLUGINS", name)
    host = PluginHost(entry_points=[good("last", "last-dist")])
    (note,) = host.notes
    assert str(note) == f"{name}: is blocked, but not installed; {hint}"
    monkeypatch.setattr(plugins_module, "PluginHost", lambda: host)
    assert main(["plugins", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["notes"][0]["plugin"] == name


# -- options models ---------------------------------------------------------------------------------------

MODELS = {
    "a function as a field": (
        "from collections.abc import Callable\nclass O(BaseModel):\n    call: Callable[[], int]",
        "",
    ),
    "a schema that raises": (
        "class O(BaseModel):\n    @classmethod\n    def model_json_schema(cls, **k): raise RuntimeError('no\\nschema')",
        "RuntimeError: no schema",
    ),
    "a schema that exits": (
        "class O(BaseModel):\n    @classmethod\n    def model_json_schema(cls, *a, **k): raise SystemExit",
        "SystemExit",
    ),
    "a schema that is no dict": (
        "class O(BaseModel):\n    @classmethod\n    def model_json_schema(cls, *a, **k): return None",
        "",
    ),
    "a schema that JSON cannot hold": (
        "class O(BaseModel):\n    x: int = Field(0, json_schema_extra={'flag': object()})",
        "",
    ),
    "a name that is not defined yet": ("class O(BaseModel):\n    x: 'Later'", "Later"),
    "a module that exits": ("raise SystemExit", "SystemExit"),
    "no model": ("O = dict", "is not a pydantic model"),
}


@pytest.mark.parametrize("mistake", MODELS)
def test_options_without_a_schema_get_an_unrestricted_table(mistake, with_bad, capsys):
    source, reason = MODELS[mistake]
    host = with_bad(
        "from lsds.contracts import BackendSpec\nfrom lsds.registry import hookimpl\n@hookimpl\n"
        "def lsds_backends():\n    return [BackendSpec('gripper', 'bad', 'bad_driver:T', 'bad_driver:O')]",
        f"from pydantic import BaseModel, Field\nprint('loud')\n{source}\n",
    )
    table = json_schema(host)["properties"]["gripper"]["properties"]["bad"]
    assert set(table) == {"type", "description"}
    assert table["type"] == "object"
    assert table["description"].startswith("gripper 'bad' of bad-dist")
    assert reason in table["description"]
    assert "\n" not in table["description"]
    json.dumps(json_schema(host))
    works(host)
    assert capsys.readouterr().out == ""


def test_a_validator_that_raises_is_an_issue_of_its_table(with_bad, fake_rig):
    host = with_bad(
        "from lsds.contracts import BackendSpec\nfrom lsds.registry import hookimpl\n@hookimpl\n"
        "def lsds_backends():\n    return [BackendSpec('gripper', 'bad', 'bad_driver:T', 'bad_driver:O')]",
        "from pydantic import BaseModel, field_validator\nclass O(BaseModel):\n    x: int = 0\n"
        "    @field_validator('x')\n    @classmethod\n    def check(cls, value): raise KeyError('k')\n",
    )
    with pytest.raises(ConfigError, match=r"gripper\.bad: its options model raised KeyError: 'k' \(upgrade it"):
        host.build("gripper", "bad", {"x": 1}, context())
    with pytest.raises(ConfigError) as caught:
        check_config({"gripper": {"bad": {"x": 1}}}, "rig.toml", host)
    assert "gripper.bad: its options model raised KeyError: 'k'" in str(caught.value)
