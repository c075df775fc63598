"""Spread work over processes of this machine, or over a cluster: Dask (by joblib) or Ray.

Every machine of the cluster needs the same version of this project. Results are the same wherever an item runs: an item
holds all that a run depends on, its seed too.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from lsds.errors import DataError
from lsds.support.extras import require
from lsds.support.processes import spread

Item = TypeVar("Item")
Result = TypeVar("Result")

DASK, RAY = ("tcp://", "tls://"), "ray://"
HELP = (
    "run on a cluster: tcp://HOST:PORT of a Dask scheduler, ray://HOST:PORT of a Ray head, or 'ray' for the local one"
)


def shared_out(
    work: Callable[[Item], Result], items: Sequence[Item], jobs: int, cluster: str
) -> Iterator[tuple[Item, Result | None]]:
    """Yield each item with its result, in any order: from `jobs` processes here, or from a cluster that is named.

    `work` must be a function of a module, and not return None. Raises DataError for a cluster that cannot be reached.
    """
    if not cluster:
        yield from spread(work, items, jobs)
        return
    if cluster.startswith(DASK):
        yield from _on_dask(work, items, cluster)
    elif cluster == "ray" or cluster.startswith(RAY):
        yield from _on_ray(work, items, cluster)
    else:
        raise DataError(f"--cluster {cluster}: name tcp://HOST:PORT (Dask), ray://HOST:PORT or ray")


def _with_item(work: Callable[[Item], Result], item: Item) -> tuple[Item, Result]:
    return item, work(item)


def _on_dask(work: Callable[[Item], Result], items: Sequence[Item], cluster: str) -> Iterator[tuple[Item, Result]]:
    require("joblib", extra="cluster", purpose="a cluster")
    require("distributed", extra="cluster", purpose="a Dask cluster")
    import distributed
    import joblib

    try:
        client: Any = distributed.Client(cluster, timeout=10)
    except (OSError, ValueError) as error:
        raise DataError(f"{cluster}: no Dask scheduler answers ({error}); start one: dask scheduler") from error
    with client, joblib.parallel_config(backend="dask"):
        parallel: Any = joblib.Parallel(return_as="generator_unordered", n_jobs=-1)
        yield from parallel(joblib.delayed(_with_item)(work, item) for item in items)


def _on_ray(work: Callable[[Item], Result], items: Sequence[Item], cluster: str) -> Iterator[tuple[Item, Result]]:
    """Joblib's backend for Ray returns nothing before the end; Ray's own tasks return each result at once."""
    require("ray", extra="ray", purpose="a Ray cluster")
    import ray

    try:
        ray.init(address=None if cluster == "ray" else cluster, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, ValueError, ConnectionError) as error:
        raise DataError(f"{cluster}: no Ray cluster answers ({error}); start one: ray start --head") from error
    try:
        task: Any = ray.remote(_with_item)
        waiting = [task.remote(work, item) for item in items]
        while waiting:
            ready, waiting = ray.wait(waiting)
            yield from ray.get(ready)
    finally:
        ray.shutdown()
