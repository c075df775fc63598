"""Spread work over processes of this machine, or over a cluster: Dask or Ray.

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

    The result is None if its process died. `work` must be a function of a module, and not return None. Raises
    DataError for a cluster that cannot be reached.
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


def _on_dask(
    work: Callable[[Item], Result], items: Sequence[Item], cluster: str
) -> Iterator[tuple[Item, Result | None]]:
    require("distributed", extra="cluster", purpose="a Dask cluster")
    import distributed

    try:
        client: Any = distributed.Client(cluster, timeout=10)
    except (OSError, ValueError) as error:
        raise DataError(f"{cluster}: no Dask scheduler answers ({error}); start one: dask scheduler") from error
    killed, suspects = distributed.KilledWorker, list[Item]()
    with client:
        items_of = {client.submit(_with_item, work, item, pure=False): item for item in items}
        for future in distributed.as_completed(list(items_of)):
            item = items_of.pop(future)
            try:
                yield future.result()
            except killed:
                suspects.append(item)
        # A worker that dies takes the items with it that wait for it: each is tried again with no other.
        for item in suspects:
            try:
                yield client.submit(_with_item, work, item, pure=False).result()
            except killed:
                yield item, None


def _on_ray(
    work: Callable[[Item], Result], items: Sequence[Item], cluster: str
) -> Iterator[tuple[Item, Result | None]]:
    require("ray", extra="ray", purpose="a Ray cluster")
    import ray

    try:
        ray.init(address=None if cluster == "ray" else cluster, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, ValueError, ConnectionError) as error:
        raise DataError(f"{cluster}: no Ray cluster answers ({error}); start one: ray start --head") from error
    try:
        task: Any = ray.remote(_with_item)
        items_of = {task.remote(work, item): item for item in items}
        while items_of:
            (ready,), _ = ray.wait(list(items_of))
            item = items_of.pop(ready)
            try:
                answer: tuple[Item, Result | None] = ray.get(ready)
            except ray.exceptions.WorkerCrashedError:
                answer = item, None
            yield answer
    finally:
        ray.shutdown()
