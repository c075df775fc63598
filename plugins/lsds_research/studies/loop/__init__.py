"""Study `loop`: whole configurations, computing time against slip and grip."""
