"""The slaves of a bus.yml of ros2_canopen."""
