"""Real recordings labelled frame by frame: labels, pictures to label by, scores."""
