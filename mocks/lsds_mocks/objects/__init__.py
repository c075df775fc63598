"""What is gripped: surfaces with texture, and a catalogue of everyday objects."""
