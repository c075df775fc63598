"""Study `grip`: how tightly controllers hold, and how far the object slips."""
