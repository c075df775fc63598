"""Training and scoring learners: fits by name, splits by object and recording, rules and controls beside them."""
