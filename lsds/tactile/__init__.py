"""From image to features: reference, dots, deformation field, contact, features."""
