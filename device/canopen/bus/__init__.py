"""Services for the bus and the node as a whole: SYNC, TIME, store (CiA 301), LSS (CiA 305)."""
