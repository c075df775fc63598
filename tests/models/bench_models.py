"""Time per frame of learned detectors and estimators, and time to load a model: `python tests/models/bench_models.py`.

Not a test. The frames are those of one simulated run. Each frame is passed without cached results, so that every
backend computes the evidence that detector and estimator share in the loop. On a busy machine use p10. The models are
the shipped ones, or else models fitted to synthetic windows (`--rows`; `--fit` always fits).
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in (".", "plugins", "drivers", "mocks", "tests")]

from lsds_plugins.models import model_path  # noqa: E402
from lsds_research.studies.frame.cost import record  # noqa: E402
from research.synthetic import examples  # noqa: E402

from lsds.clock import VirtualClock, perf_ns  # noqa: E402
from lsds.config import load_config  # noqa: E402
from lsds.contracts import BuildContext  # noqa: E402
from lsds.errors import ModelError  # noqa: E402
from lsds.models.artefact import Card, save  # noqa: E402
from lsds.registry import PluginHost  # noqa: E402
from lsds.runtime.rig import Rig  # noqa: E402
from lsds.tactile.perception import Perception  # noqa: E402

KINDS = {"detect": "detector", "estimate": "estimator"}


def observations(host):
    config = load_config(None, ["seed=0"], host=host)
    clip = record(config, host)
    rig = Rig(config, host)
    perception = Perception(rig.tracker, rig.sensor.spec, config.tactile)
    perception.start([clip.reference])
    return [perception.observe(frame)[0] for frame in clip.frames]


def model_of(name, host, context, folder, rows, fit):
    """The kind, and the path of the shipped model or of one fitted here."""
    learner = host.build("learner", name, {}, context)
    try:
        if not fit:
            return KINDS[learner.job], model_path(name, "")
    except ModelError:
        pass
    fitted = learner.fit(examples(learner.job, learner.signals, learner.length, rows), 0)
    save(
        folder / f"{name}.onnx", fitted.export(), Card(name, learner.job, learner.signals, learner.length, "synthetic")
    )
    return KINDS[learner.job], folder / f"{name}.onnx"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--rows", type=int, default=20_000)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--fit", action="store_true")
    arguments = parser.parse_args()
    host, context = PluginHost(), BuildContext(VirtualClock(), 0)
    seen = observations(host)
    with tempfile.TemporaryDirectory() as folder:
        names = arguments.names or host.names("learner")
        models = {name: model_of(name, host, context, Path(folder), arguments.rows, arguments.fit) for name in names}
        backends, loads, times = {}, {}, {name: [] for name in names}
        for name, (kind, path) in models.items():
            loads[name] = []
            for _ in range(5):
                begun = perf_ns()
                backends[name] = host.build(kind, name, {"model": str(path)}, context)
                loads[name].append((perf_ns() - begun) / 1e6)
        # In turns, so that a noisy machine disturbs all alike; the first turn warms up.
        for turn in range(arguments.repeats + 1):
            for name, backend in backends.items():
                for observation in seen:
                    fresh = replace(observation)
                    begun = perf_ns()
                    backend.update(fresh)
                    if turn:
                        times[name].append((perf_ns() - begun) / 1e3)
        print(f"{'backend':30} {'p10 us':>7} {'median us':>9} {'p99 us':>7} {'load ms':>8} {'MB':>6}  model")
        for name, (kind, path) in models.items():
            own = sorted(times[name])
            p10, p50, p99 = (own[int(share * len(own))] for share in (0.1, 0.5, 0.99))
            origin = "fitted here" if path.parent == Path(folder) else "shipped"
            print(
                f"{kind + ' ' + name:30} {p10:7.1f} {p50:9.1f} {p99:7.1f} {statistics.median(loads[name]):8.1f} "
                f"{path.stat().st_size / 1e6:6.2f}  {origin}"
            )


if __name__ == "__main__":
    main()
