"""A stand-in for the messages of builtin_interfaces: the fields that the node uses, with their defaults in ROS 2."""
