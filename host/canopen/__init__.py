"""What is said to a CANopen node from outside: SDO scripts that never wait, the conformance tester."""
