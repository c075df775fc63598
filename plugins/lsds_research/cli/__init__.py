"""Commands of research: backends of kind `command`, imported when they are called."""
