"""Recordings of real slip: reading, scoring, the study."""
