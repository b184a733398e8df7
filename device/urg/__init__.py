"""A scanning range finder of the kind URG-04LX, and the world that it sees."""
