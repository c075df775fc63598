"""The mathematics of grip: touch, load, friction limit, margin. Controllers and jobs that use it are backends."""
