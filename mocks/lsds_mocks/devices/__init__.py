"""Mock devices, face 1: in process, on the rig's clock, with the timing and the resolution of the real ones."""
