"""Network management and error control of a slave: NMT, heartbeat, guarding (CiA 301)."""
