"""Jobs: what a run is for."""
