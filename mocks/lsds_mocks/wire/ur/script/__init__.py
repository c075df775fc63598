"""URScript: text to Python generators. Any script runs that uses the language and the listed functions."""
