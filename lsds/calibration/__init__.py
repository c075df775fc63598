"""What is learnt on a cell of one's own, and written to a file that its config names."""
