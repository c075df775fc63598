"""What one frame costs."""
