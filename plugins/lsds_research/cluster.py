"""Spread work over processes of this machine, or over a cluster: Dask or Ray, by joblib.

Every machine of the cluster needs the same version of this project. Results are the same wherever an item runs: an item
holds all that a run depends on, its seed too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from lsds.errors import DataError
from lsds.extras import require
from lsds.processes import spread

if TYPE_CHECKING:
    from collections.abc import Generator

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
    with _joined(cluster) as joblib:
        parallel = joblib.Parallel(return_as="generator_unordered", n_jobs=-1)
        yield from parallel(joblib.delayed(_with_item)(work, item) for item in items)


def _with_item(work: Callable[[Item], Result], item: Item) -> tuple[Item, Result]:
    return item, work(item)


@contextmanager
def _joined(cluster: str) -> Generator[Any, None, None]:
    """Join a cluster, and leave it again; yields joblib. Raises DataError with the reason."""
    require("joblib", extra="cluster", purpose="a cluster")
    import joblib

    if cluster.startswith(DASK):
        require("distributed", extra="cluster", purpose="a Dask cluster")
        import distributed

        try:
            client: Any = distributed.Client(cluster, timeout=10)
        except (OSError, ValueError) as error:
            raise DataError(f"{cluster}: no Dask scheduler answers ({error}); start one: dask scheduler") from error
        with client, joblib.parallel_config(backend="dask"):
            yield joblib
    elif cluster == "ray" or cluster.startswith(RAY):
        require("ray", extra="ray", purpose="a Ray cluster")
        import ray
        from ray.util.joblib import register_ray

        try:
            ray.init(address=None if cluster == "ray" else cluster, log_to_driver=False)
        except (OSError, ValueError, ConnectionError) as error:
            raise DataError(f"{cluster}: no Ray cluster answers ({error}); start one: ray start --head") from error
        try:
            register_ray()
            with joblib.parallel_config(backend="ray"):
                yield joblib
        finally:
            ray.shutdown()
    else:
        raise DataError(f"--cluster {cluster}: name tcp://HOST:PORT (Dask), ray://HOST:PORT or ray")
