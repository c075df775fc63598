"""Research: datasets, collecting, learners, evaluation and all studies. Only the job `trial` runs in a cell."""
