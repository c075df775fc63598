"""Learners: they fit detectors and estimators, and export what the running cell loads.

The only place that imports a training library, and only when something is fitted. A learner bears the name of the
detector or estimator that runs what it has fitted.
"""
