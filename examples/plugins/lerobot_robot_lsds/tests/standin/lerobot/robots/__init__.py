"""Robots of the stand-in."""
