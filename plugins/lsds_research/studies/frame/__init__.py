"""Study of the computing time of one frame."""
