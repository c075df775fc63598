"""OnRobot RG2 gripper over Modbus TCP, and its mocks."""
