"""Robotiq Hand-E and 2F grippers: Modbus RTU on a serial port or over TCP, and the URCap's string server."""
