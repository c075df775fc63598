"""Gripped objects: surfaces with texture, and a catalogue of everyday objects."""
