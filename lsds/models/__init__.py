"""Trained models: files, input signals and inference."""
