"""A job in ten lines: lift a slipping pipe, and draw what happened. Figures are simulated.

python examples/job.py [PICTURE]
"""

import sys
from pathlib import Path

import lsds

session = lsds.run(overrides=["task.lift_s=1.0"])
summary = session.summary
print(f"{summary['outcome']} after {1e3 * summary['slip_distance_m']:.1f} mm of slip ({summary['figures_are']})")
session.draw(Path(sys.argv[1] if len(sys.argv) > 1 else "job.png"))
