"""The slaves of a bus.yml of ros2_canopen: what each node of it is made of."""
