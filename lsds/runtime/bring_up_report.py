"""The report of a failed bring-up: a tree with a line for each device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lsds.errors import BringUpError, DeviceError


@dataclass(frozen=True, slots=True)
class Result:
    """The result of one device; `error` is None for success."""

    kind: str
    backend: str
    error: Exception | None


def bring_up_error(step: str, results: Sequence[Result], close_failures: Sequence[Exception] = ()) -> BringUpError:
    """Return an error that lists each device of the rig: ok, or failed with reason and remedy."""
    failed = sum(result.error is not None for result in results)
    lines = [f"the rig did not come up: {failed} of {len(results)} devices failed to {step}, all are closed again"]
    widths = [max(len(getattr(result, name)) for result in results) for name in ("kind", "backend")]
    for index, result in enumerate(results):
        last = index == len(results) - 1
        head = f"{result.kind:{widths[0]}}  {result.backend:{widths[1]}}"
        lines.append(f"{'└─' if last else '├─'} {head}  {_outcome(result.error)}")
        if isinstance(result.error, DeviceError) and result.error.remedy:
            lines.append(f"{'  ' if last else '│ '}    to do: {result.error.remedy}")
    lines += [f"closing: {type(error).__name__}: {error}" for error in close_failures]
    return BringUpError("\n".join(lines))


def _outcome(error: Exception | None) -> str:
    if error is None:
        return "ok"
    if isinstance(error, DeviceError):
        code = f" [code {error.code}]" if error.code is not None else ""
        return f"failed: {type(error).__name__}: {error.problem}{code}"
    return f"failed: {type(error).__name__}: {error}"
