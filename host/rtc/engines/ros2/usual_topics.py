"""Topics of a component that no table names: those of all its ports that a message fits."""

from __future__ import annotations

import re

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.ros2.conversions import IN, OUT
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry, usual_entry
from tickrig.host.rtc.ports.data_port import InPort, OutPort


def usual_entries(component: RtComponent) -> tuple[TopicEntry, ...]:
    """Return an entry for each port, with the first message that fits: `ConsoleIn0/out`."""
    found = []
    for port in component.ports.values():
        if isinstance(port, InPort | OutPort):
            makers = OUT if isinstance(port, OutPort) else IN
            kinds = (name for name, kind in makers if kind is port.data_type)
            if (kind := next(kinds, None)) is not None:
                topic = f"{_token(component.instance_name)}/{_token(port.name)}"
                found.append(usual_entry(port.full_name, topic, kind))
    return tuple(found)


def _token(name: str) -> str:
    """Return a name as ROS 2 can have it in a topic."""
    token = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return token if token[:1].isalpha() else f"p{token}"
