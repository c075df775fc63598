"""The maps, one a file; each is a study of its own."""
