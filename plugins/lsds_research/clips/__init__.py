"""Models that look at a whole clip."""
