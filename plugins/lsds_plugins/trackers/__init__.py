"""Trackers: positions of the dots, or of the gel itself, in each frame."""
