"""The command `rh3` and its verbs."""
