"""The verb `canmon gateway`."""
