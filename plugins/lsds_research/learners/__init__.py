"""Learners: they fit detectors and estimators, and export what the running cell loads.

Training libraries are imported only here, and only when something is fitted. A learner has the same name as the
detector or estimator that runs its models.
"""
