"""Wire mocks of Robotiq grippers: one register machine behind a serial line, RTU over TCP and URCap strings."""
