"""Cameras of any make: frame sources, frame times, and access to the newest frame."""
