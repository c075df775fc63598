"""Scaffolds of plugins: a complete distribution for each kind of backend, rendered from templates."""
