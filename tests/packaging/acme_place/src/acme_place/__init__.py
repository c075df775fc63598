"""A job of somebody else: lift, place, let go."""
