"""The motor core unit (FTMD 1 axis): CiA 401 analogue objects and a motor profile of its own."""
