"""The small jobs of the core: `hold` keeps a grip next to somebody else's arm program, `watch` only looks."""

from lsds.jobs.hold import HoldJob
from lsds.jobs.watch import WatchJob

__all__ = ["HoldJob", "WatchJob"]
