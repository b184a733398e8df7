"""The conformance tester: tests one CANopen node from outside, by clause, over any CAN link."""
