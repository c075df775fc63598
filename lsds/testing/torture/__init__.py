"""Every fault on the wire against a driver or client that lsds did not write: `lsds check KIND --client`."""
