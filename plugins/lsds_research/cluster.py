"""Spread work over processes of this machine, or over a cluster: Dask or Ray.

Every machine of the cluster needs the same version of this project. Results are the same wherever an item runs: an item
holds all that a run depends on, its seed too.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, Protocol, TypeVar

from lsds.errors import DataError
from lsds.support.extras import require
from lsds.support.processes import Workers

Item = TypeVar("Item")
Result = TypeVar("Result")

DASK, RAY = ("tcp://", "tls://"), "ray://"
HELP = (
    "run on a cluster: tcp://HOST:PORT of a Dask scheduler, ray://HOST:PORT of a Ray head, or 'ray' for the local one"
)


class Share(Protocol):
    """Shares work out, see `sharing`."""

    def __call__(
        self, work: Callable[[Item], Result], items: Sequence[Item], /
    ) -> Iterator[tuple[Item, Result | None]]:
        """Yield each item with its result, in any order; the result is None if its process died."""
        ...


@contextmanager
def sharing(jobs: int, cluster: str) -> Iterator[Share]:
    """Give a function that shares work out: to `jobs` processes here, or to a cluster that is named.

    Processes and connection are kept for several calls. `work` must be a function of a module, and not return None.
    Raises DataError for a cluster that cannot be reached.
    """
    if not cluster:
        with Workers(jobs) as workers:
            yield workers.spread
    elif cluster.startswith(DASK):
        with _dask(cluster) as client:
            yield partial(_on_dask, client)
    elif cluster == "ray" or cluster.startswith(RAY):
        with _ray(cluster):
            yield _on_ray
    else:
        raise DataError(f"--cluster {cluster}: name tcp://HOST:PORT (Dask), ray://HOST:PORT or ray")


def shared_out(
    work: Callable[[Item], Result], items: Sequence[Item], jobs: int, cluster: str
) -> Iterator[tuple[Item, Result | None]]:
    """Yield each item with its result, for work that comes in one part; see `sharing`."""
    with sharing(jobs, cluster) as share:
        yield from share(work, items)


def _with_item(work: Callable[[Item], Result], item: Item) -> tuple[Item, Result]:
    return item, work(item)


def _dask(cluster: str) -> Any:
    """Return a client of a Dask scheduler."""
    require("distributed", extra="cluster", purpose="a Dask cluster")
    import distributed

    try:
        return distributed.Client(cluster, timeout=10)
    except (OSError, ValueError) as error:
        raise DataError(f"{cluster}: no Dask scheduler answers ({error}); start one: dask scheduler") from error


def _on_dask(
    client: Any, work: Callable[[Item], Result], items: Sequence[Item]
) -> Iterator[tuple[Item, Result | None]]:
    import distributed

    killed, suspects = distributed.KilledWorker, list[Item]()
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


@contextmanager
def _ray(cluster: str) -> Iterator[None]:
    """Join a Ray cluster."""
    require("ray", extra="ray", purpose="a Ray cluster")
    import ray

    try:
        ray.init(address=None if cluster == "ray" else cluster, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, ValueError, ConnectionError) as error:
        raise DataError(f"{cluster}: no Ray cluster answers ({error}); start one: ray start --head") from error
    try:
        yield
    finally:
        ray.shutdown()


def _on_ray(work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | None]]:
    import ray

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
