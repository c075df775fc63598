"""Mock devices, face 2: servers that speak each device's own protocol, so that real drivers and clients run on them."""
