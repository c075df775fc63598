"""Waiting for what another thread or process does."""

from __future__ import annotations

import time


def until(done, timeout_s=5.0):
    """Wait for something, generously; whether it came about."""
    end = time.monotonic() + timeout_s
    while not done():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True
