"""Topics of ROS 2 for a cart, where no table names others."""

from __future__ import annotations

from typing import Final

TOPICS: Final = """
[[topic]]
port = "RefHardRh30.InTargetVelocity"
topic = "cmd_vel"
type = "geometry_msgs/msg/Twist"

[[topic]]
port = "Odometry0.OdometryPosition"
topic = "odom"
type = "nav_msgs/msg/Odometry"

[[topic]]
port = "Odometry0.OdometryPosition"
topic = "tf"
type = "tf2_msgs/msg/TFMessage"

[[topic]]
port = "RefHardRh30.OutWheelAngle"
topic = "joint_states"
type = "sensor_msgs/msg/JointState"
joints = ["left_wheel", "right_wheel"]
"""

SCAN: Final = """
[[topic]]
port = "LRFCapture_URG0.ranges"
topic = "scan"
type = "sensor_msgs/msg/LaserScan"
"""
"""With a range finder."""
