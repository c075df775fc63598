"""Study `faults`: the effect of each fault on a run, compared with the same run without it."""
