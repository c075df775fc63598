"""Faults of observers: an observer that raises an exception while the fault is on."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from functools import partial
from typing import Any

from lsds_mocks.faults.made import fault
from lsds_mocks.faults.plan import Plan


def _bug() -> Exception:
    return ValueError("could not convert string to float: 'nan m'")


def _no_space() -> Exception:
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _failing(part: None, plan: Plan, error: Callable[[], Exception]) -> Callable[[Any], None]:
    def observe(cycle: Any) -> None:
        if plan.on:
            raise error()

    return observe


raises = fault(partial(_failing, error=_bug), "observers:raises")
disk_full = fault(partial(_failing, error=_no_space), "observers:disk_full")
