"""What is said to a CANopen node from outside: SDO scripts, and the conformance tester."""
