"""Studies of learned detectors and estimators."""
