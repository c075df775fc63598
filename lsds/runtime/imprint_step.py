"""The imprint as a separate step: computed when a detector or estimator asks, timed and named by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds.clock import perf_ns
from lsds.errors import LsdsError, PluginError
from lsds.runtime.histogram import LogHistogram

if TYPE_CHECKING:
    from lsds.safety.device_calls import Call, Calls
    from lsds.tactile.imprint.motion import ImprintMotion


class ImprintStep:
    """Marks, times and names the computation of one finger's imprint. `durations_ns` counts one entry a frame."""

    def __init__(self, calls: Calls, call: Call) -> None:
        self._calls, self._call = calls, call
        self.durations_ns = LogHistogram()

    def __call__(self, compute: Callable[[], ImprintMotion | None]) -> ImprintMotion | None:
        """Return the imprint's motion. Raises PluginError that names the imprint, for anything unexpected."""
        started = perf_ns()
        try:
            return self._calls.make(self._call, compute)
        except LsdsError:
            raise
        except Exception as error:
            problem = f"{self._call.who} raised {type(error).__name__}: {error}"
            raise PluginError(f"{problem} (a bug in lsds; lsds --debug shows where)") from error
        finally:
            self.durations_ns.add((perf_ns() - started,))
