"""Detectors: decide whether the object slips."""
