"""URScript, compiled to Python generators. It runs any script that uses the language and the listed functions."""
