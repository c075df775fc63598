"""Models of the gel pad behind one interface, `GelModel`."""
