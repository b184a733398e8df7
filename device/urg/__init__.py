"""A scanning range finder like the URG-04LX, and the world that it sees."""
