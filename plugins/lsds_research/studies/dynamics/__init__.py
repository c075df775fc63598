"""Integrators of dry friction."""
