"""Limits, monitors, call deadlines and validation of plugin output. None of it is a certified safety function."""
