"""The object's imprint in the light: its relief, and how it moves against the gel."""
