"""Atomic files, optional libraries, and worker processes."""
