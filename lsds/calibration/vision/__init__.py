"""Poses from an ordinary camera: calibration, printed markers, rotations. Imports cv2 when used."""
