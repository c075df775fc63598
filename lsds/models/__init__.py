"""Trained models: the file, the signals that it looks at, and running it."""
