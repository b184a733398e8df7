"""PDOs decoded: by mapping, by evidence, by DBC."""
