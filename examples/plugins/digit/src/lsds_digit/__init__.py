"""DIGIT tactile fingertip on USB, and its mock."""
