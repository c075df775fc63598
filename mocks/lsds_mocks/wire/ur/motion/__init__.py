"""Motion of the arm: profiles, moves along paths, speed and servo modes, blends, brakes."""
