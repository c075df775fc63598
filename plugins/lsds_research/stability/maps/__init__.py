"""The maps, one per file; each is a separate study."""
