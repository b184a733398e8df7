"""PDOs of a slave: mapping, RPDOs, TPDOs, MPDOs (CiA 301)."""
