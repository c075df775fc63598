"""Models that classify whole clips."""
