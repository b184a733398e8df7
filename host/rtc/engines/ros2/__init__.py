"""Ports of RT components as topics of ROS 2, over Cyclone DDS (extra tickrig[ros2])."""
