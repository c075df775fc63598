"""In-process mock devices on the rig's clock, with the timing and resolution of the real devices."""
