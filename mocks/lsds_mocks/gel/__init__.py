"""Models of the gel pad behind one seam, `GelModel`; `brush` is the first tier."""
