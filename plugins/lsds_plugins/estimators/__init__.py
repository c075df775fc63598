"""Estimators: estimate the slip velocity."""
