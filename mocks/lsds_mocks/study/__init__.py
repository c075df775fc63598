"""Studies of the simulated cell: what each model costs, and how far it is off."""
