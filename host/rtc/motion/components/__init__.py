"""The six components of the functional specification, and what it names as options."""
