"""A CANopen device as an RT component: its PDOs as ports (NEDO report, Fig. 109)."""
