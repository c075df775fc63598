"""Training and scoring of learners: fits by name, splits by object and recording, baselines and controls."""
