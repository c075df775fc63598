"""Cameras on the wire: the GelSight Mini, and the one that sees the ground truth."""
