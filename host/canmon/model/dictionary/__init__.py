"""The objects of a node: what its EDS names and what was heard of them."""
