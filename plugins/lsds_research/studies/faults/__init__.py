"""Study `faults`: what each fault does to a run, next to the same run without it."""
