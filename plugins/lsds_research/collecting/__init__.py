"""Collecting data by the protocols of the study, on whatever cell the config names."""
