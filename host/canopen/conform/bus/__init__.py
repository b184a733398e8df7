"""What is said to the node under test and heard of it, with the times of the bus."""
