"""GelSight fingertips."""
