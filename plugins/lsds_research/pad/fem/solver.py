"""A sparse direct solver for symmetric positive matrices: PARDISO if installed, else SciPy's SuperLU."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import LsdsError

if TYPE_CHECKING:
    from types import TracebackType

    from numpy.typing import NDArray


def require() -> str:
    """Return the name and version of the solver in use. Raises LsdsError if SciPy is missing."""
    try:
        import scipy
    except ImportError as error:
        raise LsdsError("finite elements need SciPy: pip install 'lsds-tactile[pad]'") from error
    pardiso = _pardiso()
    return f"SuperLU of SciPy {scipy.__version__}" if pardiso is None else f"PARDISO by pypardiso {pardiso.__version__}"


def _pardiso() -> Any:
    try:
        import pypardiso
    except (ImportError, OSError):  # OSError: the package is installed without MKL.
        return None
    return pypardiso


class Factors:
    """A factorised symmetric positive matrix; a context manager, since PARDISO's memory is not Python's."""

    def __init__(self, matrix: Any) -> None:
        from scipy import sparse
        from scipy.sparse.linalg import splu

        pardiso = _pardiso()
        self._pardiso = None
        if pardiso is None:
            self._superlu = splu(
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            return
        self._upper = sparse.triu(matrix, format="csr")
        self._pardiso = pardiso.PyPardisoSolver(mtype=2)
        self._pardiso.factorize(self._upper)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x of A x = `right` (n, columns)."""
        if self._pardiso is None:
            return np.asarray(self._superlu.solve(right))
        return np.asarray(self._pardiso.solve(self._upper, np.asfortranarray(right))).reshape(right.shape)

    def __enter__(self) -> Factors:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pardiso is not None:
            self._pardiso.free_memory(everything=True)
