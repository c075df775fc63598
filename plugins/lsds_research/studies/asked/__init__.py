"""Study `asked`: detectors and estimators as they run, asked in every frame of simulated trials."""
