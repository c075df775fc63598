"""A stand-in for the messages of std_msgs: the fields that the node uses, with their defaults in ROS 2."""
