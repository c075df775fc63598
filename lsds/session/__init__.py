"""One run from config to summary: the record of its frames, the truth of a simulated cell, the summary figures."""
