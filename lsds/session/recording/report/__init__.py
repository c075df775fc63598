"""The report of a recording: one HTML page that opens from disk and loads nothing else."""
