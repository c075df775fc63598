"""Looks for failures that nobody thought of: scenarios, their robustness, the search, the smallest that still fails."""
