"""The simulated cell: plant, event queue and the truth, shared by all mocks of a rig."""
