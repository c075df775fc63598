"""Jobs: the task of a run."""
