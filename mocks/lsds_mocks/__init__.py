"""The simulated cell: one plant (object, gel, friction, table), optics, and mock devices that meet in it."""
