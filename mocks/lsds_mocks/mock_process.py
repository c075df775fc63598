"""Wire mocks in separate processes, under the name that rigs and tests import."""

from lsds.support.mock_process import MockProcess

__all__ = ["MockProcess"]
