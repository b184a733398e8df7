"""What fails a test that has passed its own asserts."""
