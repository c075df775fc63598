"""One broken plugin never hurts the rest: a table of mistakes, each with one line of what, where and remedy."""

from __future__ import annotations

import json
import os
import sys
import tomllib
import warnings
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pytest
from fake_cell import plugin
from plugin_mistakes import BUILT, REFUSED, TOLERATED, Named

from lsds.cli import plugins as plugins_module
from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import RigConfig, check_config, json_schema
from lsds.config.example import example_config
from lsds.config.own import own_section, with_own_backends
from lsds.contracts import CONFIG_KINDS, KINDS, BackendSpec, BuildContext
from lsds.errors import ConfigError, PluginConflict, PluginError
from lsds.plugins import PluginHost
from lsds.rig import Rig

FIRST_PARTY = [
    (f"lsds-{package}", f"lsds_{package}.manifest") for package in ("plugins", "drivers", "mocks", "research")
]

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
        "from lsds.contracts import BackendSpec\nfrom lsds.plugins import hookimpl\n@hookimpl\n"
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


def test_entry_points_that_cannot_be_read(monkeypatch):
    def unreadable(group):
        raise UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte")

    monkeypatch.setattr("lsds.plugins.host.installed_entry_points", unreadable)
    host = PluginHost()
    assert host.backends == ()
    assert "entry points cannot be read" in str(host.failures[0])


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
    "a schema that is none": (
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
        "from lsds.contracts import BackendSpec\nfrom lsds.plugins import hookimpl\n@hookimpl\n"
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
        "from lsds.contracts import BackendSpec\nfrom lsds.plugins import hookimpl\n@hookimpl\n"
        "def lsds_backends():\n    return [BackendSpec('gripper', 'bad', 'bad_driver:T', 'bad_driver:O')]",
        "from pydantic import BaseModel, field_validator\nclass O(BaseModel):\n    x: int = 0\n"
        "    @field_validator('x')\n    @classmethod\n    def check(cls, value): raise KeyError('k')\n",
    )
    with pytest.raises(ConfigError, match=r"gripper\.bad: its options model raised KeyError: 'k' \(upgrade it"):
        host.build("gripper", "bad", {"x": 1}, context())
    with pytest.raises(ConfigError) as caught:
        check_config({"gripper": {"bad": {"x": 1}}}, "rig.toml", host)
    assert "gripper.bad: its options model raised KeyError: 'k'" in str(caught.value)


# -- names that lsds chooses ------------------------------------------------------------------------------


def claiming(distribution, kind="gripper", name="mock-hand-e"):
    spec = BackendSpec(kind, name, "fake_cell:FakeGripper", "fake_cell:Options", virtual_time=True)
    return SimpleNamespace(name=distribution, dist=SimpleNamespace(name=distribution), load=lambda: plugin(spec))


def test_a_claimed_default_is_that_of_lsds():
    host = PluginHost(entry_points=[claiming("lsds"), claiming("acme")])
    assert host.own("gripper", "mock-hand-e") == "lsds:mock-hand-e"
    assert PluginHost(entry_points=[claiming("lsds")]).own("gripper", "mock-hand-e") == "mock-hand-e"
    assert PluginHost(entry_points=[]).own("gripper", "mock-hand-e") == "mock-hand-e"
    with pytest.raises(PluginConflict, match="'acme:mock-hand-e' or 'lsds:mock-hand-e'"):
        host.find("gripper", "mock-hand-e")


@pytest.fixture
def claimed(installed_host):
    """Return the installed plugins, as those of lsds, and a plugin that claims a default of every kind."""
    entry_points = [
        SimpleNamespace(name=name, dist=SimpleNamespace(name="lsds"), load=EntryPoint(name, value, "lsds").load)
        for name, value in FIRST_PARTY
    ]
    acme = plugin(
        *(
            BackendSpec(kind, KINDS[kind].default, "no_module:a")
            for kind in CONFIG_KINDS
            if KINDS[kind].default != "none"
        )
    )
    entry_points.append(SimpleNamespace(name="acme", dist=SimpleNamespace(name="acme"), load=lambda: acme))
    return lambda: PluginHost(entry_points=entry_points)


def test_a_config_that_names_no_backend_is_not_stopped_by_a_claim(claimed):
    config = check_config({}, "defaults", claimed())
    assert config.gripper.backend == "lsds:mock-hand-e"
    assert check_config(config.as_tables(), "again", claimed()) == config
    options = check_config({"gripper": {"mock-hand-e": {}}}, "rig.toml", claimed())
    assert options.gripper.backend == "lsds:mock-hand-e"
    with Rig(config, claimed()) as rig:
        assert rig.gripper is not None


def test_a_config_made_in_a_program_is_not_stopped_either(claimed):
    with Rig(RigConfig(), claimed()) as rig:
        assert rig.gripper is not None
        assert rig.config.gripper.backend == "lsds:mock-hand-e"
    with Rig(RigConfig(gripper={"mock-hand-e": {}}, sensors={"left": {}}), claimed()) as rig:
        assert rig.config.fingers["left"].backend == "lsds:mock-gelsight-mini"


def test_a_name_that_the_user_wrote_has_to_be_unique(claimed):
    with pytest.raises(ConfigError, match="choose one: 'acme:mock-hand-e' or 'lsds:mock-hand-e'"):
        check_config({"gripper": {"backend": "mock-hand-e"}}, "rig.toml", claimed())
    with pytest.raises(PluginConflict, match="'acme:mock-hand-e' or 'lsds:mock-hand-e'"):
        Rig(RigConfig(gripper={"backend": "mock-hand-e"}), claimed())


def test_the_rest_of_lsds_is_not_stopped_either(claimed):
    assert "lsds:mock-hand-e" in json.dumps(json_schema(claimed()))
    example = tomllib.loads(example_config(host=claimed()))
    assert check_config(example, "example", claimed()).gripper.backend == "lsds:mock-hand-e"


def test_a_misspelt_block_in_a_config_is_an_issue():
    host = PluginHost(entry_points=[claiming("lsds"), claiming("acme")])
    with pytest.raises(ConfigError) as caught:
        check_config({"plugins": {"block": ["acm", "elsewhere"]}}, "rig.toml", host)
    assert "plugins.block: 'acm' is not installed (did you mean 'acme'?)" in str(caught.value)
    assert "elsewhere" not in str(caught.value)
    assert any(note.plugin == "elsewhere" for note in host.notes)


def test_a_backend_that_a_command_chooses_is_that_of_lsds():
    host = PluginHost(entry_points=[claiming("lsds", "job", "watch"), claiming("acme", "job", "watch")])
    config = RigConfig().model_copy(update={"job": own_section("watch", {"x": 1})})
    assert with_own_backends(config, host).job.backend == "lsds:watch"
    assert with_own_backends(config, host).job.options() == {"x": 1}
