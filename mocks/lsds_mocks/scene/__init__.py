"""Rendering of the cell for an ordinary camera: printed cards on gripper and object, a lens, an exposure."""
