"""A simulated fingertip for a scene of any simulator."""
