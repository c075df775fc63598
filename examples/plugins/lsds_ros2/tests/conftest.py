"""Let the tests import the stand-in for rclpy and its messages, whether or not ROS 2 is installed."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "standin"))
