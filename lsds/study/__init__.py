"""Studies: what each part costs, and what it earns."""
