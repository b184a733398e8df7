"""A monitor of a CAN bus: frames in, rows out; pure, with the time of its frames."""
