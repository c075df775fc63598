"""Faults of the parts of a rig, as seeded data: what goes wrong, how badly, from when, for how long."""
