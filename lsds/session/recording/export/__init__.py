"""Recordings in the formats of other tools: Parquet tables, ROS 2 bags and LeRobot datasets."""
