"""Pictures for people who would rather look than read. matplotlib is imported here and nowhere else."""
