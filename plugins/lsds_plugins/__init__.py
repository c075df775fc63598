"""Brains and views that come with lsds: trackers, detectors, estimators, controllers, replay."""
