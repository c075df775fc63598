"""Training of nets: Adam, one thread, reproducible by seed; with early stopping on held-out groups, or on all data with
a learning rate that decreases to zero."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from lsds_research.learners.common import LearnerOptions, hold_out

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray


class NetOptions(LearnerOptions):
    """Options of every net."""

    learning_rate: float = Field(default=1e-3, gt=0, le=1, description="learning rate of Adam")
    weight_decay: float = Field(default=0.0, ge=0, le=10, description="decoupled weight decay of Adam")
    batch: int = Field(default=512, ge=1, le=65536, description="batch size, windows")
    epochs: int = Field(default=100, ge=1, le=10000, description="maximum number of epochs")
    dropout: float = Field(default=0.1, ge=0, lt=1, description="dropout rate")


class StoppingOptions(NetOptions):
    """Options of nets with early stopping."""

    patience: int = Field(default=8, ge=1, le=1000, description="stop after this many epochs without improvement")


_WARM_UP = 0.15
"""Share of all steps in which the learning rate rises."""


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Use one thread and a seeded torch generator; restore both afterwards."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            yield
    finally:
        torch.set_num_threads(threads)


def train(
    net: torch.nn.Module,
    loss: Callable[[torch.Tensor, torch.Tensor], torch.Tensor],
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    group: NDArray[np.intp],
    options: StoppingOptions,
    seed: int,
) -> NDArray[np.bool_]:
    """Train in place, to be called within `seeded`; return (n,) the mask of held-out rows that chose the best epoch.

    `x` (n, length, F) is the input of the net, `y` that of the loss.
    """
    import torch

    held = hold_out(group, seed)
    inputs, wanted = torch.from_numpy(x[~held]), torch.from_numpy(y[~held])
    held_inputs, held_wanted = torch.from_numpy(x[held]), torch.from_numpy(y[held])
    adam = torch.optim.AdamW(net.parameters(), lr=options.learning_rate, weight_decay=options.weight_decay)
    best, best_state, since = float("inf"), _copy(net), 0
    for _ in range(options.epochs):
        _pass(net, loss, inputs, wanted, adam, options.batch)
        with torch.no_grad():
            now = float(loss(_in_pieces(net, held_inputs), held_wanted))
        if now < best:
            best, best_state, since = now, _copy(net), 0
        else:
            since += 1
            if since >= options.patience:
                break
    net.load_state_dict(best_state)
    net.eval()
    return held


def train_whole(
    net: torch.nn.Module,
    loss: Callable[[torch.Tensor, torch.Tensor], torch.Tensor],
    draw: Callable[[np.random.Generator], tuple[NDArray[np.float32], NDArray[np.float32]]],
    options: NetOptions,
    seed: int,
) -> None:
    """Train in place on all data, to be called within `seeded`: nothing is held out, and the learning rate decreases to
    zero.

    `draw` returns x and y for each of `options.epochs` passes.
    """
    import torch

    rng = np.random.default_rng(seed)
    adam = torch.optim.AdamW(net.parameters(), lr=options.learning_rate, weight_decay=options.weight_decay)
    rate: Any = None
    for _ in range(options.epochs):
        x, y = (torch.from_numpy(values) for values in draw(rng))
        if rate is None:
            steps = options.epochs * -(-len(x) // options.batch)
            rate = torch.optim.lr_scheduler.OneCycleLR(
                adam, options.learning_rate, total_steps=steps + 1, pct_start=_WARM_UP
            )
        _pass(net, loss, x, y, adam, options.batch, rate.step)


def _pass(
    net: torch.nn.Module,
    loss: Callable[[torch.Tensor, torch.Tensor], torch.Tensor],
    x: torch.Tensor,
    y: torch.Tensor,
    adam: torch.optim.Optimizer,
    batch: int,
    then: Callable[[], object] = lambda: None,
) -> None:
    """Step over all examples once, in newly drawn batches."""
    import torch

    net.train()
    for rows in torch.split(torch.randperm(len(x)), batch):
        adam.zero_grad(set_to_none=True)
        loss(net(x[rows]), y[rows]).backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 5.0)
        adam.step()
        then()
    net.eval()


def predicted(net: torch.nn.Module, x: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the output of the net for windows (n, length, F), by torch on one thread."""
    import torch

    with seeded(0), torch.no_grad():
        return np.asarray(_in_pieces(net, torch.from_numpy(np.ascontiguousarray(x))).numpy())


def array(parameter: Any) -> NDArray[np.float32]:
    """Return a parameter's values."""
    return np.asarray(parameter.detach().numpy())


def _in_pieces(net: torch.nn.Module, x: torch.Tensor) -> torch.Tensor:
    import torch

    return torch.cat([net(piece) for piece in torch.split(x, 8192)])


def _copy(net: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.detach().clone() for name, value in net.state_dict().items()}
