"""Trackers: where the dots, or the gel itself, are in each frame."""
