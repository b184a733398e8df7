"""The conformance tester: judges one CANopen node from outside, by clause, over any CAN link."""
