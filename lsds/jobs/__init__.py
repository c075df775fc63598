"""The small jobs of the core: `hold` keeps a grip while another program moves the arm, `watch` only observes."""

from lsds.jobs.hold import HoldJob
from lsds.jobs.watch import WatchJob

__all__ = ["HoldJob", "WatchJob"]
