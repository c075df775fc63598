"""A stand-in for LeRobot: the base classes and the registry that the plugin uses, written from its documentation."""
