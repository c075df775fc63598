"""How a wire face reaches the plant: within its own process, or in one that all faces share."""
