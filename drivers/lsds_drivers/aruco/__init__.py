"""Poses of marked bodies by any camera."""
