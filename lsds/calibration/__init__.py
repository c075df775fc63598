"""Calibration of the user's own cell, written to files that its config names."""
