"""The figures printed in the paper (arXiv 2411.07442), for comparison only. Nothing is computed from them."""

from __future__ import annotations

CROSS_VALIDATION: dict[tuple[str, str], tuple[float, float, float, float]] = {
    ("random-forest", "baseline"): (93.94, 94.83, 92.31, 93.55),
    ("random-forest", "proposed"): (99.11, 98.76, 99.11, 98.93),
    ("random-forest", "combined"): (99.37, 99.10, 99.38, 99.24),
    ("gradient-boosting", "baseline"): (93.97, 94.75, 92.46, 93.59),
    ("gradient-boosting", "proposed"): (99.22, 98.97, 99.17, 99.07),
    ("gradient-boosting", "combined"): (99.57, 99.49, 99.47, 99.48),
}
"""Accuracy, precision, recall, F1 (%) in five folds over frames at random."""

UNSEEN_ACCURACY: dict[tuple[str, str], float] = {
    ("random-forest", "book"): 91.76,
    ("gradient-boosting", "book"): 83.71,
    ("random-forest", "scissors"): 99.51,
    ("gradient-boosting", "scissors"): 99.57,
    ("random-forest", "plank"): 98.11,
    ("gradient-boosting", "plank"): 97.77,
    ("random-forest", "sponge"): 74.78,
    ("gradient-boosting", "sponge"): 43.71,
    ("random-forest", "duster"): 99.49,
    ("gradient-boosting", "duster"): 99.68,
    ("random-forest", "all"): 92.7,
}
"""Accuracy (%) on objects not trained on."""

LEAVE_ONE_OUT: dict[tuple[str, str], tuple[float, float, float]] = {
    ("lstm", "baseline"): (0.45, 1.31, 0.45),
    ("lstm", "proposed"): (0.37, 1.10, 0.58),
    ("lstm", "combined"): (0.26, 0.77, 0.75),
    ("mlp", "baseline"): (0.54, 1.40, 0.38),
    ("mlp", "proposed"): (0.43, 1.21, 0.51),
    ("mlp", "combined"): (0.30, 1.01, 0.68),
}
"""MAE, RMSE (cm/s) and R2, one object left out at a time."""

SEVERITY_UNSEEN: dict[tuple[str, str], tuple[float, float, float]] = {
    ("lstm", "book"): (0.65, 0.92, 0.65),
    ("mlp", "book"): (0.98, 1.51, 0.54),
    ("lstm", "scissors"): (0.53, 0.90, 0.67),
    ("mlp", "scissors"): (0.89, 1.11, 0.58),
    ("lstm", "plank"): (0.64, 1.01, 0.68),
    ("mlp", "plank"): (1.27, 1.43, 0.57),
    ("lstm", "sponge"): (0.61, 1.19, 0.60),
    ("mlp", "sponge"): (1.39, 1.51, 0.50),
    ("lstm", "duster"): (0.42, 0.68, 0.80),
    ("mlp", "duster"): (0.67, 0.93, 0.66),
}
"""MAE, RMSE (cm/s) and R2 on the five unseen objects."""

PIPE: dict[str, tuple[float, float, float]] = {"lstm": (0.21, 0.41, 0.68)}
"""MAE, RMSE (cm/s) and R2 on the pipe of the demonstration."""
