"""Controllers: the aperture that stops the slip."""
