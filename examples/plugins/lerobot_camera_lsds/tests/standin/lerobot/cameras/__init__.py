"""Cameras of the stand-in."""
