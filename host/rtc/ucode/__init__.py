"""Environment position detection (NEDO report, Fig. 123): reader, settlement, contents."""
