"""Recordings: everything that a run took in and sent out, in one MCAP file."""
