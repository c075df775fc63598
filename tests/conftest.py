"""Fixtures of the whole suite."""

from __future__ import annotations

import copy
import gc
import os
import signal
import sys
from pathlib import Path

# Before NumPy is there: with two workers of two threads each on two cores, each waits for the others.
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

# A shell that starts the suite in the background has it ignore Ctrl-C, and so would all processes that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
# The suite runs from a checkout that is not installed, too.
for folder in ("", "plugins", "drivers", "mocks", "tests"):
    path = str(ROOT / folder) if folder else str(ROOT)
    if path not in sys.path:
        sys.path.append(path)

import installed  # noqa: E402
import tiers  # noqa: E402
from fake_cell import FAKE_RIG, fake_host  # noqa: E402

DURATIONS: dict[str, float] = {}
"""Duration (s) of each test of this session, by node id."""

settings.register_profile("lsds", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("lsds")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--store-durations", metavar="FILE", help="write the durations of the tests (tests/tiers.py)")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    # Importing the modules of all tests takes a third of the time of the quick ones.
    folder = collection_path.relative_to(ROOT / "tests").parts[:1] if ROOT / "tests" in collection_path.parents else ()
    return True if config.option.markexpr == "quick" and folder and folder[0] not in tiers.QUICK_FOLDERS else None


@pytest.hookimpl(tryfirst=True)  # before -m selects
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    durations = tiers.stored()
    for item in items:
        for mark in tiers.tiers(item.nodeid, {own.name for own in item.iter_markers()}, durations):
            item.add_marker(mark)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    DURATIONS[report.nodeid] = DURATIONS.get(report.nodeid, 0.0) + report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    file = session.config.getoption("--store-durations")
    if file and not hasattr(session.config, "workerinput"):
        tiers.store(DURATIONS, Path(file))


def pytest_collection_finish() -> None:
    # Python's collector runs the later the more objects live on. Beside a whole suite's tests and modules, runs that
    # have ended, with all their frames, would wait for it until a worker holds gigabytes.
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def _runs_that_have_ended_are_let_go():
    """Only the collector frees a reference cycle of a test's objects, and the run and frames that it holds."""
    yield
    gc.collect()


@pytest.fixture(autouse=True)
def _output_of_any_width(monkeypatch):
    """Tables fit a width that the environment states; tests read whole lines."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture
def root() -> Path:
    return ROOT


@pytest.fixture
def host():
    return fake_host()


@pytest.fixture
def fake_rig():
    """The raw config of a rig of fakes; change it as you like."""
    return copy.deepcopy(FAKE_RIG)


@pytest.fixture
def installed_host():
    """The host of the first-party plugins; skips where the default rig cannot be built from them yet."""
    missing = [package for package in ("lsds_plugins", "lsds_mocks") if not installed.has_manifest(package)]
    if missing:
        pytest.skip(f"no manifest in {', '.join(missing)}")
    return installed.installed_host()
