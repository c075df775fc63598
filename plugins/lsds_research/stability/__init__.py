"""Maps of where methods fail: two axes, a pass criterion, every method next to naive ones."""
