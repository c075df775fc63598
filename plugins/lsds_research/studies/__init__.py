"""Studies: each returns tables and can draw a picture."""
