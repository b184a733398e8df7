"""The node under test: what it has, and what stands for the names in checks."""
