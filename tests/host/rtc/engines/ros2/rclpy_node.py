# mypy: ignore-errors
"""A node of ROS 2, run by a Python that has rclpy. Commands on stdin, JSON on stdout, as peer.py.

read TOPIC TYPE, write TOPIC TYPE NUMBER..., with types as geometry_msgs/msg/Twist
"""

import importlib
import json
import select

import rclpy


class Node:
    def __init__(self) -> None:
        rclpy.init()
        self.node, self.publishers = rclpy.create_node("judge"), {}
        self.commands = open(0, "rb", buffering=0)  # noqa: SIM115 - of this process

    def run(self) -> None:
        print(json.dumps({"ready": rclpy.get_rmw_implementation_identifier()}), flush=True)
        while True:
            rclpy.spin_once(self.node, timeout_sec=0.005)
            if select.select([self.commands], [], [], 0)[0]:
                if not (line := self.commands.readline()):
                    return
                self.obey(line.decode().split())

    def obey(self, words: list[str]) -> None:
        verb, topic, name, *numbers = words
        package, _, short = name.split("/")
        kind = getattr(importlib.import_module(f"{package}.msg"), short)
        if verb == "read":
            self.node.create_subscription(kind, topic, lambda message: show(topic, message), 10)
            return
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(kind, topic, 10)
        self.publishers[topic].publish(made(kind(), [float(number) for number in numbers]))


def made(message: object, numbers: list[float]) -> object:
    """Fill a Twist, or the data of a message."""
    if hasattr(message, "data"):
        message.data = type(message.data)(numbers[0])
        return message
    message.linear.x, message.angular.z = numbers
    return message


def show(topic: str, message: object) -> None:
    print(json.dumps({"topic": topic, "message": plain(message)}), flush=True)


def plain(value: object) -> object:
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return value[0]
    if hasattr(value, "__len__") and not isinstance(value, str):
        return [plain(each) for each in value]
    return value.item() if hasattr(value, "item") else value


if __name__ == "__main__":
    Node().run()
