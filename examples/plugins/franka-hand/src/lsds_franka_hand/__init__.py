"""Franka Hand by the blocking commands of libfranka, and its fake."""
