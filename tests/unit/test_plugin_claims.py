"""Names that a plugin claims: lsds chooses its own backends by default; a name in a config has to be unique."""

from __future__ import annotations

import json
import tomllib
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import pytest
from fake_cell import plugin

from lsds.config import RigConfig, check_config, json_schema
from lsds.config.example import example_config
from lsds.config.own import own_section, with_own_backends
from lsds.contracts import CONFIG_KINDS, KINDS, BackendSpec
from lsds.errors import ConfigError, PluginConflict
from lsds.registry import PluginHost
from lsds.registry.backends import OWN_DISTRIBUTION
from lsds.runtime.rig import Rig

FIRST_PARTY = [
    (f"lsds-{package}", f"lsds_{package}.manifest") for package in ("plugins", "drivers", "mocks", "research")
]


def claiming(distribution, kind="gripper", name="mock-hand-e"):
    spec = BackendSpec(kind, name, "fake_cell:FakeGripper", "fake_cell:Options", virtual_time=True)
    return SimpleNamespace(name=distribution, dist=SimpleNamespace(name=distribution), load=lambda: plugin(spec))


def test_a_claimed_default_is_that_of_lsds():
    host = PluginHost(entry_points=[claiming(OWN_DISTRIBUTION), claiming("acme")])
    assert host.own("gripper", "mock-hand-e") == "lsds:mock-hand-e"
    assert PluginHost(entry_points=[claiming(OWN_DISTRIBUTION)]).own("gripper", "mock-hand-e") == "mock-hand-e"
    assert PluginHost(entry_points=[]).own("gripper", "mock-hand-e") == "mock-hand-e"
    with pytest.raises(PluginConflict, match="'acme:mock-hand-e' or 'lsds:mock-hand-e'"):
        host.find("gripper", "mock-hand-e")


@pytest.fixture
def claimed(installed_host):
    """Return the installed plugins, as those of lsds, and a plugin that claims a default of every kind."""
    own = SimpleNamespace(name=OWN_DISTRIBUTION)
    entry_points = [
        SimpleNamespace(name=name, dist=own, load=EntryPoint(name, value, "lsds").load) for name, value in FIRST_PARTY
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
    host = PluginHost(entry_points=[claiming(OWN_DISTRIBUTION), claiming("acme")])
    with pytest.raises(ConfigError) as caught:
        check_config({"plugins": {"block": ["acm", "elsewhere"]}}, "rig.toml", host)
    assert "plugins.block: 'acm' is not installed (did you mean 'acme'?)" in str(caught.value)
    assert "elsewhere" not in str(caught.value)
    assert any(note.plugin == "elsewhere" for note in host.notes)


def test_a_backend_that_a_command_chooses_is_that_of_lsds():
    host = PluginHost(entry_points=[claiming(OWN_DISTRIBUTION, "job", "watch"), claiming("acme", "job", "watch")])
    config = RigConfig().model_copy(update={"job": own_section("watch", {"x": 1})})
    assert with_own_backends(config, host).job.backend == "lsds:watch"
    assert with_own_backends(config, host).job.options() == {"x": 1}
