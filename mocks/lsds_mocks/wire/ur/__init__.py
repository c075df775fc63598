"""Wire mock of an e-Series arm: script interpreter, motion, and the controller's ports."""
