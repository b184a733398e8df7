"""Communication with CANopen nodes: SDO scripts, a master, and the conformance tester."""
