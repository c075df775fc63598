"""The finite-pad correction of the simulated gel: finite elements that make its table."""
