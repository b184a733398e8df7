"""What `canmon conform` stands on: where the node is, who moves its inputs, what is asked."""
