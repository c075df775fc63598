"""The gel that chooses its own grid: the coarsest that keeps the dots within a stated tolerance."""
