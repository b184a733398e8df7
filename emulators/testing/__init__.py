"""Tools for tests: the bench, its rig files and reports, the plug-in, tests of devices."""
