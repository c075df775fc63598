"""Studies of what the plugins here can do."""
