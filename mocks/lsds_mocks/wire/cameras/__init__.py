"""Wire mocks of cameras: the GelSight Mini and the ground-truth camera."""
