"""Trackers of printed dots: one way to follow, two ways to measure."""
