"""A third-party job: lift, place, release."""
