"""Feel slip through a camera-based tactile fingertip and close the gripper just enough."""

__version__ = "0.1.0"
