"""Collecting data by the paper's protocols on the cell of a config."""
