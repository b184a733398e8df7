"""The plug-in of pytest: fixtures, markers, failure reports, and health checks after each test."""
