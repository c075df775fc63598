"""Recordings as sensors."""
