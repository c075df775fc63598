"""Research commands: backends of kind `command`, imported when they are called."""
