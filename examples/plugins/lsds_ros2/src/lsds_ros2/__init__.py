"""A node of ROS 2 around the engine of lsds: it publishes fingertip and grip, and takes grip goals and velocities."""
