"""Renders surface and markers as an image: 320 x 240 RGB, as a GelSight Mini after the vendor's crop."""
