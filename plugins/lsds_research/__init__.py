"""Research: datasets, collecting, learners, evaluation and all studies. Nothing here runs in a cell."""
