"""The pytest plugin of lsds: fixtures for tests of plugins and rigs, and a summary of skipped checks.

pytest loads it from the entry point group `pytest11`. Everything but pytest is imported inside the fixtures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lsds.clock import VirtualClock
    from lsds.registry.host import PluginHost
    from lsds.runtime.rig import Rig
    from lsds.testing.mock_handle import MockHandle

SKIPPED = "lsds check needs"
"""Beginning of the reason with which a check is skipped, before the key of `lsds.testing.outcomes.NEEDS`."""


@pytest.fixture
def virtual_clock() -> VirtualClock:
    """A clock in simulated time that starts at zero and advances only by its sleeps."""
    from lsds.clock import VirtualClock

    return VirtualClock()


@pytest.fixture
def lsds_faults() -> Callable[..., None]:
    """A function that adds a fault to the rigs that `lsds_rig` builds afterwards.

    Call it as `lsds_faults("camera-noise", severity=5, at="lift")`.
    """
    return _Faults()


@pytest.fixture
def lsds_rig(lsds_faults: Any) -> Iterator[Callable[..., Rig]]:
    """A function that builds a rig, `lsds_rig("task.lift_s=1", seed=7)`, and closes it after the test.

    Its arguments are overrides of the default config, as texts or by name; `host` and `clock` are those of `Rig`.
    Raises ConfigError and PluginError.
    """
    rigs: list[Rig] = []

    def build(*overrides: str, host: PluginHost | None = None, clock: Any = None, **keys: Any) -> Rig:
        from lsds.config.loader import load_config
        from lsds.config.overrides import override_texts
        from lsds.runtime.rig import Rig

        if lsds_faults.tables:
            keys["faults"] = lsds_faults.tables
        config = load_config(None, [*overrides, *override_texts(keys)], host=host)
        rigs.append(Rig(config, host, clock=clock))
        lsds_faults.built = True
        return rigs[-1]

    yield build
    for rig in reversed(rigs):
        rig.close()


@pytest.fixture
def lsds_cell(lsds_rig: Callable[..., Rig]) -> Any:
    """The simulated cell of a rig with default devices, connected and with a known truth (`cell.truth()`).

    Skips the test if no simulated cell is installed.
    """
    from lsds.registry.host import PluginHost

    host = PluginHost()
    found = [backend for backend in host.backends if (backend.spec.kind, backend.spec.name) == ("cell", "simulated")]
    if not found:
        pytest.skip("no simulated cell is installed; pip install 'lsds-tactile[sim]'")
    if missing := host.missing_requirements(found[0]):
        pytest.skip(f"the simulated cell needs {', '.join(missing)}; pip install 'lsds-tactile[sim]'")
    rig = lsds_rig(host=host)
    rig.connect()
    return rig.cell


@pytest.fixture
def wire_mock() -> Iterator[Callable[..., MockHandle]]:
    """A function that starts `lsds.testing.wire_mock` with the same arguments, `wire_mock("hand-e", transport="tcp")`.

    The mock runs in its own process, on free ports, and ends with the test. Its handle maps faces to addresses. Raises
    ConnectFailed with the mock's message.
    """
    from lsds.testing.mock_handle import wire_mock as handle_of

    handles: list[MockHandle] = []

    def start(name: str, **arguments: Any) -> MockHandle:
        handles.append(handle_of(name, **arguments))
        return handles[-1].start()

    yield start
    for handle in reversed(handles):
        handle.stop()


@pytest.fixture
def isolated_plugins(monkeypatch: pytest.MonkeyPatch) -> Callable[..., PluginHost]:
    """A function that returns a `PluginHost` with only the given manifests, `isolated_plugins("acme_lsds.manifest")`.

    A manifest is a module, its name, or any object with hook implementations.
    """

    def build(*manifests: Any) -> PluginHost:
        import importlib

        from lsds.registry.host import BLOCK_VARIABLE, PluginHost

        monkeypatch.delenv(BLOCK_VARIABLE, raising=False)
        host = PluginHost(entry_points=[])
        for number, given in enumerate(manifests):
            manifest = importlib.import_module(given) if isinstance(given, str) else given
            label = getattr(manifest, "__name__", f"manifest-{number}")
            host.register(manifest, distribution=label, name=label)
        if host.failures:
            reasons = "; ".join(f"{failure.plugin}: {failure.reason}" for failure in host.failures)
            pytest.fail(f"a manifest is not valid: {reasons}", pytrace=False)
        return host

    return build


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Print how many conformance checks were skipped for want of something, and what they need."""
    reasons = [str(report.longrepr[2]) for report in terminalreporter.stats.get("skipped", ()) if _has_reason(report)]
    needed = [reason.partition(SKIPPED)[2].split(":")[0].strip() for reason in reasons if SKIPPED in reason]
    if not needed:
        return
    from lsds.testing.outcomes import NEEDS, skip_line

    terminalreporter.section("lsds checks")
    for need, (argument, _, person) in NEEDS.items():
        if need in needed:
            terminalreporter.write_line(skip_line(need, needed.count(need), argument, person))


def _has_reason(report: Any) -> bool:
    return isinstance(getattr(report, "longrepr", None), tuple) and len(report.longrepr) == 3


class _Faults:
    """Collects tables of `[[faults]]` until a rig is built."""

    def __init__(self) -> None:
        self.tables: list[dict[str, Any]] = []
        self.built = False

    def __call__(self, name: str, *, severity: int | None = None, at: str | None = None) -> None:
        """Add a fault. Fails the test if a rig has been built already."""
        if self.built:
            pytest.fail(f"the fault '{name}' comes after lsds_rig() has built a rig; add it before", pytrace=False)
        self.tables.append({"backend": name, "severity": severity, "at": at})
