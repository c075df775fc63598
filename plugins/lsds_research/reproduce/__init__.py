"""The paper's tables, measured on simulated data and compared with the printed figures."""
