"""Drivers of real hardware: bytes and vendor calls. Each imports its vendor library only when it is used."""
