"""Qualities of service."""

qos_profile_sensor_data = 5
"""The profile of sensors, here as its depth."""
