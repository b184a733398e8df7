"""A node of ROS 2 (rclpy) drives a cart of `rh3 serve --ros2` a way ahead, by its odometry."""

from __future__ import annotations

import sys
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

AHEAD_M = float(sys.argv[1]) if len(sys.argv) > 1 else 0.3


def main() -> None:
    """Drive, and stop."""
    rclpy.init()
    node, place = rclpy.create_node("driver"), {"x": 0.0, "speed": 0.0}

    def moved(odometry: Any) -> None:
        place["x"] = odometry.pose.pose.position.x
        place["speed"] = odometry.twist.twist.linear.x

    node.create_subscription(Odometry, "odom", moved, 10)
    publisher = node.create_publisher(Twist, "cmd_vel", 10)
    twist = Twist()
    while place["x"] < AHEAD_M or abs(place["speed"]) > 0.001:
        twist.linear.x = 0.2 if place["x"] < AHEAD_M else 0.0
        publisher.publish(twist)
        rclpy.spin_once(node, timeout_sec=0.05)
    print(f"at {place['x']:.2f} m")


if __name__ == "__main__":
    main()
