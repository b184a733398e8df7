"""The verbs of `canmon`, a module each, and the options that several share."""
