"""The reference's dots as a graph: neighbours along the printed grid, and the ring of cells around it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import MarkerReference

#: Steps to the four neighbours of a node: row, column.
_NODE_STEPS = ((0, 1), (0, -1), (1, 0), (-1, 0))


class Lattice:
    """Nodes 0..count-1 are the markers in the reference's order, the rest is the ring of cells that touch them.

    `neighbour` (nodes, 4) node right, left, below, above, with `has_neighbour` telling which exist; `known_empty`
    (ring,) where the reference showed that no dot is printed; `complete` where the whole pad is in the reference;
    `bridge` (nodes,) the ring's nodes next to a marker whose neighbours are all worn off.
    """

    def __init__(self, reference: MarkerReference, complete: bool = False) -> None:
        self.count = reference.count
        self.home_px = reference.xy_px
        self.pitch_px = float(np.mean(reference.pitch_px))
        self.width, self.height = reference.image_size
        self._limit = np.array([self.width - 1.0, self.height - 1.0])
        self.complete = complete
        cells = [(int(r), int(c)) for r, c in reference.cell]
        node = {cell: i for i, cell in enumerate(cells)}
        origin: list[int] = []
        offset: list[tuple[float, float]] = []
        steps = reference.axes * np.array(reference.pitch_px)[:, None]
        for i, (row, column) in enumerate(cells):
            for d_row, d_column in _NODE_STEPS:
                cell = (row + d_row, column + d_column)
                if cell not in node:
                    node[cell] = len(node)
                    origin.append(i)
                    offset.append(tuple(d_column * steps[0] + d_row * steps[1]))
        self._node = node
        self._cells = list(node)
        self._origin = np.array(origin, np.intp)
        self._offset = np.array(offset).reshape(-1, 2)
        self.neighbour = np.zeros((len(node), 4), np.intp)
        self.has_neighbour = np.zeros((len(node), 4), bool)
        for cell, i in node.items():
            for k, (d_row, d_column) in enumerate(_NODE_STEPS):
                j = node.get((cell[0] + d_row, cell[1] + d_column))
                if j is not None:
                    self.neighbour[i, k], self.has_neighbour[i, k] = j, True
        alone = ~(self.has_neighbour & (self.neighbour < self.count))[: self.count].any(axis=1)
        self.bridge = np.zeros(len(node), bool)
        self.bridge[self.neighbour[: self.count][alone]] = True
        ring_px = self.extend(reference.xy_px)[self.count :]
        self.known_empty = np.full(len(ring_px), self.complete)
        if not self.complete:
            self.known_empty = self.in_view(ring_px, 0.35 * self.pitch_px)
        self._shifted: dict[tuple[int, int], NDArray[np.intp]] = {}
        self._dropped: dict[tuple[int, int], NDArray[np.intp]] = {}
        right = self.neighbour[: self.count, 0]
        below = self.neighbour[: self.count, 2]
        #: Markers with a marker to the right and one below: the corners of a cell, for area consistency.
        self.corner = np.flatnonzero(
            self.has_neighbour[: self.count, 0]
            & self.has_neighbour[: self.count, 2]
            & (right < self.count)
            & (below < self.count)
        )
        self.corner_right, self.corner_below = right[self.corner], below[self.corner]
        away = np.abs(reference.cell[:, None, :] - reference.cell[None, :, :]).max(axis=-1)
        self._around = (away > 0) & (away <= 2)

    def stray(self, moved_px: NDArray[np.float64], trusted: NDArray[np.bool_], limit_px: float) -> NDArray[np.bool_]:
        """Return which trusted markers (N,) moved (N, 2) otherwise than the median of those within two cells.

        A marker with fewer than three trusted ones around it cannot be judged and passes.
        """
        around = self._around & trusted
        count = around.sum(axis=1)
        # Medians over ragged neighbourhoods: the untrusted sort to the end, the middle is that of the rest.
        padded = np.where(around[..., None], moved_px[None, :, :], np.inf)
        padded.sort(axis=1)
        middle = padded[np.arange(self.count), np.maximum(count - 1, 0) // 2]
        judged = trusted & (count >= 3)
        off = np.zeros(self.count)
        off[judged] = np.abs(moved_px[judged] - middle[judged]).max(axis=1)
        return np.asarray(off > limit_px)

    def connected(self, seeds: NDArray[np.bool_], members: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the members (N,) that hang together with a seed (N,) over neighbours that are members."""
        neighbour = np.minimum(self.neighbour[: self.count], self.count - 1)
        linked = self.has_neighbour[: self.count] & (self.neighbour[: self.count] < self.count)
        reached = seeds & members
        while True:
            more = members & ~reached & (reached[neighbour] & linked).any(axis=1)
            if not more.any():
                return reached
            reached |= more

    def extend(self, marker_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions (nodes, 2) of the markers (N, 2) given and of the ring that moves along with them."""
        return np.concatenate([marker_px, marker_px[self._origin] + self._offset])

    def in_view(self, xy_px: NDArray[np.float64], margin_px: float) -> NDArray[np.bool_]:
        """Return which positions (..., 2) lie in the image, at least `margin_px` from its border."""
        inside = (xy_px >= margin_px) & (xy_px <= self._limit - margin_px)
        return np.asarray(inside[..., 0] & inside[..., 1])

    def shifted(self, shift: tuple[int, int]) -> NDArray[np.intp]:
        """Return (nodes,) the node that is `shift` = (rows, columns) away from each node, -1 beyond the lattice."""
        if shift not in self._shifted:
            self._shifted[shift] = np.array(
                [self._node.get((row + shift[0], column + shift[1]), -1) for row, column in self._cells], np.intp
            )
        return self._shifted[shift]

    def dropped(self, shift: tuple[int, int]) -> NDArray[np.intp]:
        """Return the nodes that no node reaches under `shift`: their dots would belong to nothing printed."""
        if shift not in self._dropped:
            source = self.shifted(shift)
            self._dropped[shift] = np.setdiff1d(np.arange(len(self._cells)), source[: self.count])
        return self._dropped[shift]
