"""The command line. A command is imported when it is called, so `lsds --help` imports nothing heavy."""
