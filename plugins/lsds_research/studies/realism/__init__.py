"""Side by side with recordings: the same tracker and features over real videos and over simulated clips."""
