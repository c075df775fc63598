"""The running cell: from the newest frame to the command, on a schedule."""
