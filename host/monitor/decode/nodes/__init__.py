"""What was heard of each node, and the board of all."""
