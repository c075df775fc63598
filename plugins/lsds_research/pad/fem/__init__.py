"""Finite elements of a gel pad, for the correction that `lsds_research.pad.make_pad` writes; not needed at run time."""
