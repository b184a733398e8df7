"""The physical side of a DeviceRTC: what the component declares, its ports and its state."""

from __future__ import annotations

from collections import Counter
from typing import Final

from tickrig.device.canopen.device_rtc.component import CanopenComponent
from tickrig.device.canopen.device_rtc.life_cycle import CanopenLifeCycle
from tickrig.device.component import shown
from tickrig.device.physical import InputSignal, OutputSignal, SignalType

SHUT_DOWN: Final = "shut_down"

INPUTS: Final = (
    InputSignal(
        SHUT_DOWN,
        "button: the component ends, and the node is silent until a power cut",
        SignalType.BUTTON,
    ),
)
"""Every DeviceRTC has these; a component may add its own."""

OUTPUTS: Final = (
    OutputSignal("rtc_state", "Created, Inactive, Active, Error or Finalized"),
    OutputSignal("callback", "the callback that ran last"),
    OutputSignal("executed", "how often on_execute ran"),
)
"""Every DeviceRTC has these; each port adds its value as in.NAME or out.NAME."""


def inputs_of(kind: type[CanopenComponent]) -> tuple[InputSignal, ...]:
    """Return the physical inputs of a component; ValueError if two have the same name."""
    table = (*INPUTS, *kind.physical)
    name, count = Counter(item.name for item in table).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{kind.__name__}: {count} inputs are called {name!r}")
    return table


def outputs_of(component: CanopenComponent) -> dict[str, OutputSignal]:
    """Return the physical outputs of a component."""
    ports = [
        OutputSignal(
            f"{port.direction.value}.{port.name}", f"value of this {port.direction.value}-port"
        )
        for port in component.ports.values()
    ]
    return {output.name: output for output in (*OUTPUTS, *ports)}


def text_of(life: CanopenLifeCycle, name: str) -> float | str:
    """Return the present value of an output; KeyError if there is none."""
    match name:
        case "rtc_state":
            return life.state.value
        case "callback":
            return life.latest
        case "executed":
            return life.executed
    return shown(life.component.ports[name.partition(".")[2]].value)
