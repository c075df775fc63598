"""How a wire face reaches the plant: in its own process alone, or in another one together with the other faces."""
