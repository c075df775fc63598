"""The cell as an ordinary camera sees it: printed cards on gripper and object, a lens, an exposure."""
