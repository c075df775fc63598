"""Learning slip from recordings: datasets, splits, metrics, controls, model artefacts."""
