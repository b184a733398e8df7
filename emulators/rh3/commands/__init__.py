"""The command `rh3`, and what its verbs share."""
