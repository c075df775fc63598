"""Certificates of random rigs against plain counts.

`python -m tests.research.certify.random_rigs --rigs 20 --runs 48 --counted 96 [--out FILE] [--jobs 2]` draws rigs
(timing, noise, fingers, algorithms), certifies each with a number of lifts, and counts the drops among other lifts
drawn evenly from the same space. Rigs that are in FILE are not run again; `--rigs 0` only sums up. Those done so far
are in `rigs.jsonl` next to this file. A count of n lifts has an error, too: it is also compared with the 95 %
of counts that the interval, taken as a Beta distribution, predicts. Figures are simulated.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from lsds_research.certify.options import CertifyOptions
from lsds_research.certify.study import QUICK, CertifyStudy
from scipy.stats import beta, betabinom

from lsds.clock import VirtualClock
from lsds.config.overrides import override_texts
from lsds.contracts import BuildContext

FIRST = 4000
"""Seed of the first rig; no other draw in the tree uses seeds from here on."""


def drawn(rig: int) -> list[str]:
    """Return the config keys of a random rig."""
    rng = np.random.default_rng([FIRST, rig])
    return override_texts(
        {
            "gripper.mock-hand-e.latency_ms": round(float(rng.uniform(10, 120)), 1),
            "gripper.mock-hand-e.command_loss": round(float(rng.uniform(0, 0.2)), 3),
            "cell.simulated.finger_stiffness_n_mm": round(float(rng.uniform(2.5, 10)), 2),
            "cell.simulated.modulus_mpa": round(float(rng.uniform(0.12, 0.32)), 3),
            "sensor.mock-gelsight-mini.rate_hz": round(float(rng.uniform(15, 40)), 1),
            "sensor.mock-gelsight-mini.latency_ms": round(float(rng.uniform(15, 60)), 1),
            "sensor.mock-gelsight-mini.noise": round(float(rng.uniform(0.5, 3)), 2),
            "detector.backend": str(rng.choice(["fused", "imprint", "rigid-residual", "threshold"])),
            "estimator.backend": str(rng.choice(["fused", "field"])),
            "controller.backend": str(rng.choice(["belief", "pd"])),
        }
    )


def certified(settings: list[str], runs: int, seed: int, jobs: int, *, plain: bool) -> dict[str, Any]:
    options = CertifyOptions(runs=runs, settings=[*QUICK, *settings], jobs=jobs, plain=plain)
    study = CertifyStudy(options, BuildContext(VirtualClock(), seed=seed))
    details = study.run(lambda done, asked: None).details
    return {**details["probability"], "auc": details["auc"]}


def predicts(certificate: dict[str, Any], failed: int, runs: int) -> bool:
    """Return whether 95 % of the counts that the certificate's interval predicts contain this one."""
    low, high, mean = (float(np.clip(certificate[key], 1e-4, 1 - 1e-4)) for key in ("least", "most", "estimate"))
    mean = min(max(mean, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    # The Beta distribution with this mean whose 95 % interval is as wide as the certificate's.
    sizes = np.geomspace(1.0, 1e5, 400)
    widths = beta.ppf(0.975, mean * sizes, (1 - mean) * sizes) - beta.ppf(0.025, mean * sizes, (1 - mean) * sizes)
    size = float(sizes[np.argmin(np.abs(widths - (high - low)))])
    predicted = betabinom(runs, mean * size, (1 - mean) * size)
    return bool(predicted.ppf(0.025) <= failed <= predicted.ppf(0.975))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, usual in (("rigs", 20), ("runs", 48), ("counted", 96), ("jobs", 2), ("first", 0)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    parser.add_argument("--out", type=Path)
    own = parser.parse_args()
    done = own.out.read_text(encoding="utf-8").splitlines() if own.out and own.out.exists() else []
    rows = [json.loads(line) for line in done]
    for rig in range(own.first, own.first + own.rigs):
        if any(row["rig"] == rig for row in rows):
            continue
        settings = drawn(rig)
        certificate = certified(settings, own.runs, FIRST + rig, own.jobs, plain=False)
        count = certified(settings, own.counted, 2 * FIRST + rig, own.jobs, plain=True)
        rate = count["failed"] / count["runs"]
        row = {
            "rig": rig,
            "settings": settings,
            "certificate": certificate,
            "counted": count,
            "covers": certificate["least"] <= rate <= certificate["most"],
            "predicts": predicts(certificate, count["failed"], count["runs"]),
        }
        rows.append(row)
        if own.out:
            with own.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        print(
            f"rig {rig}: {certificate['estimate']:.3f} ({certificate['least']:.3f} to {certificate['most']:.3f}) of "
            f"{certificate['runs']}, counted {rate:.3f} of {count['runs']}, covers: {row['covers']}, predicts: "
            f"{row['predicts']}; AUC {certificate['auc']}",
            flush=True,
        )
    covers, predicted = (sum(row[key] for row in rows) for key in ("covers", "predicts"))
    least = beta.ppf(0.05, predicted, len(rows) - predicted + 1) if predicted else 0.0
    print(
        f"interval contains the count of {covers} of {len(rows)} rigs; predicts it for {predicted}, so for at least "
        f"{least:.0%} of all rigs (95 %, one-sided)"
    )


if __name__ == "__main__":
    main()
