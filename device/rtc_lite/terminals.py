"""The physical side of a node: its supply, its processor, and what can be seen of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tickrig.device.component import shown
from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.ports import LitePort

INPUTS: Final = (
    InputSignal("callback_ms", "how long each callback takes", high=10_000, unit="ms"),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
    InputSignal(
        "slow_answer", "the processor is busy elsewhere: each answer is late", SignalType.FAULT
    ),
)
"""Every node has these; a component may add its own."""

OUTPUTS: Final = (
    OutputSignal("state", "state of the component: Off, Created, Inactive, Active, Error, None"),
    OutputSignal("callback", "the callback that ran last"),
    OutputSignal("executed", "how often on_execute ran"),
    OutputSignal("dropped_bytes", "bytes that found the receive buffer full"),
)
"""Every node has these; each port adds its value."""


def new_inputs(component: LiteComponent) -> InputBank:
    """Return the inputs of a node at rest.

    Raises:
        ValueError: two inputs have the same name.
    """
    names = {item.name for item in INPUTS}
    kind = type(component).__name__
    for item in component.physical:
        if item.name in names:
            raise ValueError(f"{kind}: two inputs are called {item.name!r}")
        names.add(item.name)
    return InputBank((*INPUTS, *component.physical))


def output_table(component: LiteComponent) -> dict[str, OutputSignal]:
    """Return the outputs of a node: its own, and the ports as `in.NAME` and `out.NAME`."""
    ports = [
        *(
            OutputSignal(f"in.{name.decode()}", "value of this in-port")
            for name in component.in_ports
        ),
        *(
            OutputSignal(f"out.{name.decode()}", "value of this out-port")
            for name in component.out_ports
        ),
    ]
    return {output.name: output for output in (*OUTPUTS, *ports)}


def port_text(component: LiteComponent, name: str) -> float | str:
    """Return the value of the port `in.NAME` or `out.NAME`; KeyError if there is none."""
    side, _, port = name.partition(".")
    ports: dict[str, Mapping[bytes, LitePort[Any]]] = {
        "in": component.in_ports,
        "out": component.out_ports,
    }
    return shown(ports[side][port.encode()].value)
