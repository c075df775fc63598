"""What a simulated finger's frame costs, and how right its colours are."""
