"""The verbs of `canmon net`: a CANopen network set to work."""
