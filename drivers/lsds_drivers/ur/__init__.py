"""Universal Robots e-Series arms over RTDE, by ur_rtde in a child process."""
