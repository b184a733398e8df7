"""Communication with the node under test, with the times of the bus."""
