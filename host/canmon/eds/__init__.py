"""The verbs of `canmon eds`."""
