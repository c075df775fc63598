"""Algorithms and replay that come with lsds: trackers, detectors, estimators, controllers."""
