"""Models of the simulated gel: speed against accuracy."""
