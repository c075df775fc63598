"""`python -m lsds` is the command `lsds`."""

from lsds.cli.main import program

if __name__ == "__main__":
    program()
