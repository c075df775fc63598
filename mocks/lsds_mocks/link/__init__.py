"""Links of a wire mock to a plant: in its own process, or in a process shared by all mocks."""
