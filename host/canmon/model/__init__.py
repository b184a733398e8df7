"""A monitor of a CAN bus: frames in, rows out; pure, told the time by its frames."""
