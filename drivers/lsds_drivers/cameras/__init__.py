"""Cameras of any make: where frames come from, when they were taken, and the newest one of them."""
