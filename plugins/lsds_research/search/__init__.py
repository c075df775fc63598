"""Search for scenarios in which the cell fails: robustness, search, shrinking, and the probability of a failure."""
