"""A rig on your desk for robot electronics you do not have."""

__version__ = "0.1.0"
