"""Study of computing time and colour error of a simulated finger's frame."""
