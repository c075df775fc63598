"""The study's tables, measured here on simulated data, beside what was printed."""
