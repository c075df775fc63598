from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import pytest
from fake_cell import SPECS, FakeGripper, plugin

from lsds.clock import VirtualClock
from lsds.contracts import BackendSpec, BuildContext
from lsds.errors import ConfigError, ContractMismatch, PluginConflict, PluginLoadError, PluginNotFound
from lsds.registry import PluginHost, hookimpl
from lsds.registry.backends import OWN_DISTRIBUTION
from lsds.registry.contract import check_contract


class FakeEntryPoint:
    def __init__(self, name, distribution, load):
        self.name = name
        self.dist = SimpleNamespace(name=distribution)
        self._load = load

    def load(self):
        return self._load()


def raising(error):
    def load():
        raise error

    return load


def returning(value):
    namespace = SimpleNamespace()
    namespace.lsds_backends = hookimpl(lambda: value)
    namespace.lsds_backends.__name__ = "lsds_backends"
    return lambda: namespace


GOOD = BackendSpec("gripper", "good", "fake_cell:FakeGripper", "fake_cell:Options", virtual_time=True)


def good_entry_point(name="good-plugin", distribution="good-dist"):
    return FakeEntryPoint(name, distribution, lambda: plugin(GOOD))


def context():
    return BuildContext(VirtualClock())


# -- finding ----------------------------------------------------------------------------------------------


def test_entry_points_are_loaded_on_the_first_question_only():
    loads = []

    def load():
        loads.append(1)
        return plugin(GOOD)

    host = PluginHost(entry_points=[FakeEntryPoint("a", "dist", load)])
    assert loads == []
    assert host.names("gripper") == ("good",)
    assert host.find("gripper", "good").distribution == "dist"
    assert loads == [1]


@pytest.mark.parametrize(
    ("load", "reason"),
    [
        (raising(ImportError("no module named acme")), "ImportError: no module named acme"),
        (raising(SystemExit("bye")), "SystemExit: bye"),
        (raising(SyntaxError("what")), "SyntaxError"),
        (returning(None), "returned NoneType"),
        (returning("text"), "returned str"),
        (returning([GOOD, 3]), "a list with int in it"),
        (returning([BackendSpec("toaster", "a", "m:a")]), "unknown kind 'toaster'"),
        (returning([BackendSpec("gripper", "none", "m:a")]), "'none' is not allowed"),
        (returning([BackendSpec("gripper", "a b", "m:a")]), "'a b' is not allowed"),
        (returning([BackendSpec("gripper", "a", "just_a_module")]), "'module:attribute'"),
    ],
)
def test_a_broken_plugin_is_listed_and_the_others_work(load, reason):
    host = PluginHost(entry_points=[FakeEntryPoint("bad", "bad-dist", load), good_entry_point()])
    assert [backend.spec.name for backend in host.backends] == ["good"]
    (failure,) = host.failures
    assert (failure.plugin, failure.distribution) == ("bad", "bad-dist")
    assert reason in failure.reason
    assert host.build("gripper", "good", {}, context())


def test_a_hook_that_raises_and_a_hook_that_does_not_exist_are_reported():
    namespace = SimpleNamespace()

    @hookimpl
    def lsds_backends():
        raise RuntimeError("boom")

    @hookimpl
    def lsds_backend():
        return []

    namespace.lsds_backends = lsds_backends
    host = PluginHost(
        entry_points=[
            FakeEntryPoint("raises", "d1", lambda: namespace),
            FakeEntryPoint("typo", "d2", lambda: SimpleNamespace(lsds_backend=lsds_backend)),
            good_entry_point(),
        ]
    )
    assert [f.plugin for f in host.failures] == ["raises", "typo"]
    assert "boom" in host.failures[0].reason
    assert "lsds_backend" in host.failures[1].reason
    assert host.names("gripper") == ("good",)


def test_an_unknown_name_comes_with_a_suggestion_and_the_reasons_of_failures(host):
    with pytest.raises(PluginNotFound, match="did you mean 'fake-gripper'"):
        host.find("gripper", "fake-griper")
    broken = PluginHost(entry_points=[FakeEntryPoint("bad", "bad-dist", raising(ImportError("libfoo")))])
    with pytest.raises(PluginNotFound, match=r"installed: none; note: plugin bad .*libfoo"):
        broken.find("gripper", "x")


def test_a_name_claimed_twice_is_an_error_unless_the_config_names_the_distribution():
    host = PluginHost(entry_points=[good_entry_point("a", "dist-a"), good_entry_point("b", "dist-b")])
    with pytest.raises(PluginConflict, match="'dist-a:good' or 'dist-b:good'"):
        host.find("gripper", "good")
    assert host.find("gripper", "dist-b:good").distribution == "dist-b"
    assert isinstance(host.build("gripper", "dist-a:good", {}, context()), FakeGripper)


@pytest.mark.parametrize("name", ["good", "lsds:good", "lsds-tactile:good", "lsds-plugins:good"])
def test_a_first_party_backend_is_selected_by_prefix_distribution_or_plugin(name):
    host = PluginHost(entry_points=[good_entry_point("lsds-plugins", OWN_DISTRIBUTION)])
    found = host.find("gripper", name)
    assert (found.distribution, found.qualified_name) == ("lsds-tactile", "lsds:good")
    assert isinstance(host.build("gripper", name, {}, context()), FakeGripper)


@pytest.mark.parametrize("name", ["lsds", "lsds-tactile", "lsds-plugins"])
def test_first_party_plugins_are_blocked_by_each_of_their_names(name):
    own = good_entry_point("lsds-plugins", OWN_DISTRIBUTION)
    host = PluginHost(entry_points=[own, good_entry_point("acme", "acme-dist")], block=[name])
    assert [backend.distribution for backend in host.backends] == ["acme-dist"]
    assert host.unknown_blocks() == {}


def test_the_prefix_names_no_other_distribution():
    with pytest.raises(PluginNotFound):
        PluginHost(entry_points=[good_entry_point("acme", "acme-dist")]).find("gripper", "lsds:good")


def test_a_distribution_of_the_former_name_is_the_duplicate():
    manifest = plugin(GOOD)
    entry_points = [FakeEntryPoint("lsds-plugins", name, lambda: manifest) for name in ("lsds", OWN_DISTRIBUTION)]
    host = PluginHost(entry_points=entry_points)
    assert host.find("gripper", "lsds:good").distribution == OWN_DISTRIBUTION
    (failure,) = host.failures
    assert (failure.distribution, failure.reason) == ("lsds", "it is installed twice")


def test_two_plugins_of_one_distribution_are_selected_by_plugin():
    host = PluginHost(entry_points=[good_entry_point("a", "dist"), good_entry_point("b", "dist")])
    with pytest.raises(PluginConflict, match="'a:good' or 'b:good'"):
        host.find("gripper", "good")
    assert host.find("gripper", "a:good").plugin == "a"


@pytest.mark.parametrize("name", ["good-plugin", "good-dist"])
def test_blocking_by_argument_by_environment_and_later(monkeypatch, name):
    def never():
        raise AssertionError("a blocked plugin was imported")

    entry_points = [FakeEntryPoint("good-plugin", "good-dist", never)]
    assert PluginHost(entry_points=entry_points, block=[name]).failures[0].blocked
    monkeypatch.setenv("LSDS_BLOCK_PLUGINS", f"other, {name}")
    assert PluginHost(entry_points=entry_points).failures[0].reason == "blocked"
    monkeypatch.delenv("LSDS_BLOCK_PLUGINS")

    host = PluginHost(entry_points=[good_entry_point()])
    assert host.names("gripper") == ("good",)
    host.block([name])
    assert host.names("gripper") == ()
    assert [f.plugin for f in host.failures if f.blocked] == ["good-plugin"]


def test_first_party_manifests_may_be_missing():
    # Whatever is installed, asking must not raise.
    assert isinstance(PluginHost().backends, tuple)


# -- building ---------------------------------------------------------------------------------------------


def test_building_validates_the_options(host):
    gripper = host.build("gripper", "fake-gripper", {"latency_ms": 40}, context())
    assert gripper.options.latency_ms == 40
    with pytest.raises(ConfigError) as caught:
        host.build("gripper", "fake-gripper", {"latency": 40, "fail": 3}, context())
    assert {issue.path for issue in caught.value.issues} == {
        "gripper.fake-gripper.latency",
        "gripper.fake-gripper.fail",
    }
    assert "did you mean 'latency_ms'?" in str(caught.value)


def test_a_backend_without_options_gets_none_and_takes_none(host):
    assert host.build("detector", "plain", None, context()).options is None
    with pytest.raises(ConfigError, match=r"detector.plain.x: this backend takes no options"):
        host.build("detector", "plain", {"x": 1}, context())


def test_missing_requirements_name_the_extra(host):
    with pytest.raises(PluginLoadError, match=r"a_vendor_sdk_nobody_has.*pip install 'fakes\[acme\]'"):
        host.build("gripper", "no-sdk", {}, context())
    assert host.missing_requirements(host.find("gripper", "no-sdk")) == ("a_vendor_sdk_nobody_has",)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("gone", "importing 'fake_cell:NoSuchClass' failed: AttributeError"),
        ("odd-options", "is not a pydantic model"),
        ("refuses", "factory 'fake_cell:refuse' raised ValueError: no such luck"),
    ],
)
def test_what_cannot_be_built_is_an_error_with_the_reason(host, name, message):
    with pytest.raises(PluginLoadError, match=message):
        host.build("gripper", name, {}, context())


def test_a_wrong_contract_lists_every_problem_at_once(host):
    with pytest.raises(ContractMismatch) as caught:
        host.build("gripper", "incomplete", {}, context())
    message = str(caught.value)
    assert "spec is missing" in message
    assert "read() is missing" in message
    assert "stop is NoneType, not a method" in message
    assert "connect() is async" in message
    assert "command() cannot be called as (command)" in message
    assert "lifecycle" not in message
    assert message.count("\n") == 0


@pytest.mark.parametrize("spec", [s for s in SPECS if s.name in ("fake-sensor", "fake-arm", "fake-poses", "fake-cell")])
def test_the_fakes_fulfil_their_contracts(host, spec):
    assert host.build(spec.kind, spec.name, {}, context())


def test_properties_are_looked_up_without_being_called():
    class Shy(FakeGripper):
        @property
        def spec(self):
            raise RuntimeError("not connected")

    check_contract("shy", "gripper", Shy.__new__(Shy))


def test_a_proxy_that_answers_by_getattr_is_fine():
    class Proxy:
        def __init__(self, inner):
            self._inner = inner

        def __getattr__(self, name):
            return getattr(self._inner, name)

    inner = FakeGripper.__new__(FakeGripper)
    inner.guard = SimpleNamespace(state=None)
    check_contract("proxy", "gripper", Proxy(inner))


def test_listing_plugins_imports_nothing_heavy():
    code = (
        "import sys; from lsds.registry import PluginHost; PluginHost().backends\n"
        "heavy = {'cv2', 'torch', 'sklearn', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
