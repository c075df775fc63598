"""How the arm moves: profiles, moves along paths, speed and servo modes, blends, brakes."""
