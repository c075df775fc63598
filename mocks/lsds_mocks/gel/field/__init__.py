"""Contact on a meshed pad: elastic operators, and solvers of friction contact with memory."""
