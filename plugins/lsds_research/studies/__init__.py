"""Studies: each measures something and can be drawn."""
