"""Robotiq grippers on the wire: one register machine behind a serial line, RTU over TCP and the URCap's strings."""
