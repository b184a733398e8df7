"""A monitor of a CAN bus, with frames as input and rows as output.

The monitor uses the time of the frames.
"""
