"""Let the tests import the stand-in for LeRobot, whether or not LeRobot is installed."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "standin"))
