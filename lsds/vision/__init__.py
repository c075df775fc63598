"""Where things are, as an ordinary camera sees them: calibration, printed markers, poses. Imports cv2 when used."""
