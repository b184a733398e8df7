"""What tickrig compare does: both runs of a device or a bus, and what it prints."""
