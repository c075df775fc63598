"""The command line. Commands are imported when they are called, so that `lsds --help` imports nothing heavy."""
