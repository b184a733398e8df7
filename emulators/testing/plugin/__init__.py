"""The plug-in of pytest: fixtures, markers, what a failure tells, health after each test."""
