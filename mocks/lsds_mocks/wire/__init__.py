"""Wire mocks: servers that speak each device's protocol, so that real drivers and clients can use them."""
