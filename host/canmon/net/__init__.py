"""The verbs of `canmon net`: set up a CANopen network."""
