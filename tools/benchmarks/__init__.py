"""The suites of tools/bench."""
