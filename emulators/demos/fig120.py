"""`tickrig demo fig120`: a potentiometer turns a motor, without a PC in between (Fig. 120)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from math import cos, pi
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import can
import canopen

from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.bench.child import running
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.models import MODELS, EmulatedModel
from tickrig.emulators.canopen.node import Node, side_of
from tickrig.emulators.commands.picture import new_figure, write_figure
from tickrig.emulators.rig.emulated import read_signal
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.control.client import ControlClient
from tickrig.host.text.values import Setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# What the demonstration looks at while it runs, as a table and as a picture.

_FULL_SCALE: Final = 32_767
_FULL_SCALE_DEG: Final = 180.0


class CurveSample(NamedTuple):
    """The state of both devices of the demonstration `fig120` at one time.

    The potentiometer of the I/O module (palette) controls the angle of the motor.

    Attributes:
        time_s: seconds since the potentiometer was first turned.
        volts: voltage at the analogue input of the palette.
        reference: latest reference value of the motor core unit, its object 6411h:01. The unit
            receives the value in the PDO with the COB-ID 290h.
        angle_deg: angle of the motor's shaft.
    """

    time_s: float
    volts: float
    reference: int
    angle_deg: float

    @property
    def reference_deg(self) -> float:
        """The reference in degrees, with the full scale that 2010h:01 has at power-on."""
        return self.reference * _FULL_SCALE_DEG / _FULL_SCALE


_HEAD: Final = "  time s   potentiometer V   290h    reference deg   shaft deg"


def _row(sample: CurveSample) -> str:
    """Write a sample as a line of the table.

    >>> _row(CurveSample(0.35, 2.5, 16384, 90.0021))
    '   0.350             2.500   00 40         90.0027     90.0021'
    """
    data = sample.reference.to_bytes(2, "little", signed=True).hex(" ").upper()
    return (
        f"{sample.time_s:8.3f}  {sample.volts:16.3f}   {data}"
        f"  {sample.reference_deg:14.4f}  {sample.angle_deg:10.4f}"
    )


_TITLE: Final = "Fig. 120: a potentiometer on node 16 turns the motor of node 32"


def write_plot(samples: Sequence[CurveSample], path: Path) -> None:
    """Draw voltage, reference and angle of the demonstration over time, and write the picture.

    Args:
        samples: recorded states of both devices.
        path: path of a PNG, SVG or HTML file.

    Raises:
        OSError: the file cannot be written.
    """
    write_figure(_draw(samples), _TITLE, path)


def _draw(samples: Sequence[CurveSample]) -> Figure:
    figure = new_figure(9, 6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2))
    times = [sample.time_s for sample in samples]
    figure.suptitle(_TITLE)
    above.plot(times, [sample.volts for sample in samples], color="tab:orange")
    above.set_ylabel("analogue input 1, V")
    above.set_ylim(-0.2, 5.2)
    references = [sample.reference_deg for sample in samples]
    below.plot(
        times, references, color="tab:gray", drawstyle="steps-post", label="reference 6411h:01"
    )
    below.plot(
        times,
        [sample.angle_deg for sample in samples],
        color="tab:blue",
        label="shaft of the motor",
    )
    below.set_ylabel("angle, degrees")
    below.set_xlabel("time, s")
    below.legend(loc="upper left")
    for axes in (above, below):
        axes.grid(visible=True, alpha=0.3)
    return figure


# What the master of Fig. 120 does before it leaves the bus.

PALETTE: Final = 16
MOTOR: Final = 32

LINK: Final = 0x290
"""COB-ID of the PDO link: TPDO2 of the palette, RPDO2 of the motor core unit."""

_OFF: Final = 1 << 31


@dataclass(frozen=True, slots=True)
class _Write:
    """An expedited SDO download.

    Attributes:
        node_id: node-ID of the server.
        index: index of the object.
        sub: sub-index of the object.
        value: the written value.
        size: size of the value in bytes.
        text: purpose of the download, as readable text.
    """

    node_id: int
    index: int
    sub: int
    value: int
    size: int
    text: str


_WRITES: Final = (
    _Write(PALETTE, 0x1017, 0, 100, 2, "heartbeat each 100 ms"),
    _Write(MOTOR, 0x1017, 0, 100, 2, "heartbeat each 100 ms"),
    _Write(PALETTE, 0x1801, 1, _OFF | LINK, 4, "TPDO2 off"),
    _Write(PALETTE, 0x1A01, 0, 0, 1, "no entries"),
    _Write(PALETTE, 0x1A01, 1, 0x6401_0110, 4, "analogue input 1, 16 bit"),
    _Write(PALETTE, 0x1A01, 0, 1, 1, "one entry"),
    _Write(PALETTE, 0x1801, 2, 255, 1, "event-driven"),
    _Write(PALETTE, 0x1801, 3, 100, 2, "inhibit time 10 ms"),
    _Write(PALETTE, 0x1801, 5, 50, 2, "event timer 50 ms"),
    _Write(PALETTE, 0x6426, 1, 8, 4, "delta: more than one step of the converter"),
    _Write(PALETTE, 0x6423, 0, 1, 1, "analogue events on"),
    _Write(PALETTE, 0x1801, 1, LINK, 4, "TPDO2 on, COB-ID 290h"),
    _Write(MOTOR, 0x2000, 0, 3, 1, "angle mode"),
    _Write(MOTOR, 0x1401, 1, _OFF | LINK, 4, "RPDO2 off, the palette's COB-ID"),
    _Write(MOTOR, 0x1601, 0, 0, 1, "no entries"),
    _Write(MOTOR, 0x1601, 1, 0x6411_0110, 4, "reference, 16 bit"),
    _Write(MOTOR, 0x1601, 0, 1, 1, "one entry"),
    _Write(MOTOR, 0x1401, 2, 255, 1, "act on reception"),
    _Write(MOTOR, 0x1401, 1, LINK, 4, "RPDO2 on: the link is made"),
)
"""The downloads in the order of the NEDO report (3.4.43.3, Fig. 120: PDO linking)."""

_PATIENCE_S: Final = 30.0
"""Time-out of an SDO answer on a busy machine; the library waits 0.3 s and tries once."""

_START_ORDER: Final = (MOTOR, PALETTE)


def set_up(network: canopen.Network) -> None:
    """Configure and start both nodes, so that the potentiometer controls the motor.

    A master does this by SDO and NMT. Afterwards no master is needed.

    Raises:
        canopen.SdoCommunicationError: a node does not answer.
        canopen.SdoAbortedError: a node refuses a download.
    """
    nodes = {
        node_id: network.add_node(node_id, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]  # canopen's
        for node_id in (PALETTE, MOTOR)
    }
    for node in nodes.values():
        node.sdo.RESPONSE_TIMEOUT = _PATIENCE_S
    for write in _WRITES:
        data = write.value.to_bytes(write.size, "little")
        nodes[write.node_id].sdo.download(write.index, write.sub, data)
    for node_id in _START_ORDER:
        nodes[node_id].nmt.send_command(1)


# Where the demonstration is played: in virtual time, or on a bus of python-can.

BIT_RATE: Final = 1_000_000
CAST: Final = {PALETTE: "f-palette", MOTOR: "motor-core-unit"}
"""Models by node-ID."""

_EMULATOR: Final = "tickrig.emulators.canopen.cli"


class VirtualStage:
    """A rig in virtual time.

    Attributes:
        wire: the bus.
    """

    step_us = 1_000

    def __init__(self) -> None:
        self.wire = wire = CanWire(BIT_RATE)
        nodes = [_node(node_id, MODELS[name], wire) for node_id, name in CAST.items()]
        self._nodes = side_of(nodes)
        self._rig = Rig(*(Station(node, node.port) for node in nodes))
        self.network: canopen.Network = SimNetwork(self._rig, wire.end())
        self.run_to(10_000)  # both have booted

    @property
    def now_us(self) -> int:
        """Time of the rig."""
        return self._rig.now_us

    def run_to(self, at_us: int) -> None:
        """Run the rig."""
        self._rig.run_to(at_us)

    def get(self, name: str) -> Setting:
        """Return the value of a signal of a node."""
        return read_signal(self._nodes, name)

    def set(self, name: str, value: Setting) -> None:
        """Set a signal of a node."""
        self._nodes.inputs.set(name, value)


class _BusStage:
    """An emulator in a separate process on a bus of python-can, in real time."""

    step_us = 20_000

    def __init__(self, network: canopen.Network, hand: ControlClient) -> None:
        self.network, self._hand = network, hand

    @property
    def now_us(self) -> int:
        """Time of the machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def run_to(self, at_us: int) -> None:
        """Wait."""
        time.sleep(max(0, at_us - self.now_us) / 1e6)

    def get(self, name: str) -> Setting:
        """Read the value of a signal from the emulator."""
        values = self._hand.request("get", names=[name])["values"]
        assert isinstance(values, dict)
        value: Setting = values[name]
        return value

    def set(self, name: str, value: Setting) -> None:
        """Set a signal in the emulator."""
        self._hand.request("set", name=name, value=value)


_Fig120Stage = VirtualStage | _BusStage
"""Both devices, and the bus that the master is on at first."""


@contextmanager
def bus_stage(
    arguments: Sequence[str], open_bus: Callable[[], can.BusABC]
) -> Iterator[_Fig120Stage]:
    """Context manager in which an emulator and a master run on the same real CAN bus.

    Args:
        arguments: arguments of the emulator's command line that select the bus.
        open_bus: function that opens the same bus for the master.

    Raises:
        RuntimeError: the emulator does not start.
    """
    nodes = [f"--node={node_id}={model}" for node_id, model in CAST.items()]
    with ExitStack() as stack:
        child = stack.enter_context(running(_EMULATOR, *nodes, *arguments, linked=False))
        hand = stack.enter_context(ControlClient(child.control, _PATIENCE_S))
        bus = open_bus()
        stack.callback(bus.shutdown)
        network = canopen.Network(bus)
        stack.callback(network.disconnect)
        yield _BusStage(network.connect(), hand)


def _node(node_id: int, model: EmulatedModel, wire: CanWire) -> Node:
    slave = make_slave(model.dictionary(), node_id, application=model.application)
    return Node(str(node_id), slave, wire)


# `tickrig demo fig120`: set up, leave the bus, turn the potentiometer, watch the motor.

_Echo = Callable[[str], None]
_STEPS_V: Final = (0.0, 1.25, 2.5, 3.75, 5.0)
_STEP_US: Final = 600_000
_TURN_US: Final = 2_000_000
_REST_US: Final = 300_000
_PERIOD_US: Final = 100_000
"""Period of the lines of the table, a tenth of a second."""

_POTENTIOMETER: Final = f"{PALETTE}/ai1_v"
_REFERENCE: Final = f"{MOTOR}/0x6411:1"
_SHAFT: Final = f"{MOTOR}/angle_deg"

_AT_REST_DEG: Final = 0.01


@dataclass(frozen=True, slots=True)
class _Act:
    """A part of the demonstration.

    Attributes:
        title: description as readable text.
        duration_us: duration of the act.
        volts: function that returns the voltage of the potentiometer for the elapsed share of the
            act, 0..1.
        is_step: whether the shaft arrives within the act.
    """

    title: str
    duration_us: int
    volts: Callable[[float], float]
    is_step: bool = False


def _acts() -> Iterator[_Act]:
    """Yield the steps of the report's table, then a slow turn back."""
    for volts in _STEPS_V:
        yield _Act(
            f"The potentiometer is set to {volts} V.", _STEP_US, partial(_held, volts), is_step=True
        )
    yield _Act("It is turned back slowly.", _TURN_US, _turned_back)
    yield _Act("It rests.", _REST_US, partial(_held, 0.0))


def _held(volts: float, done: float) -> float:
    return volts


def _turned_back(done: float) -> float:
    return round(_STEPS_V[-1] / 2 * (1 + cos(pi * done)), 3)


def run_demo(stage: _Fig120Stage, echo: _Echo) -> list[CurveSample]:
    """Play the demonstration.

    Returns:
        All samples.

    Raises:
        canopen.SdoCommunicationError: a node does not answer.
    """
    echo(f"Node {PALETTE} is an f-palette with a potentiometer at its analogue input 1.")
    echo(f"Node {MOTOR} is a motor core unit.\n")
    for write in _WRITES:
        value = f"{write.value:0{2 * write.size}X}h"
        echo(
            f"  node {write.node_id}  {write.index:04X}h:{write.sub:02X} = {value:<10}{write.text}"
        )
    set_up(stage.network)
    stage.network.disconnect()
    echo(f"\nBoth are started; {LINK:03X}h links them. The master has left the bus.")
    return _turn(stage, echo)


def _turn(stage: _Fig120Stage, echo: _Echo) -> list[CurveSample]:
    samples: list[CurveSample] = []
    start_us = begin_us = stage.now_us
    for act in _acts():
        echo(f"\n{act.title}\n{_HEAD}")
        first = len(samples)
        for at_us in range(begin_us, begin_us + act.duration_us, stage.step_us):
            stage.run_to(at_us)
            stage.set(_POTENTIOMETER, act.volts((at_us - begin_us) / act.duration_us))
            sample = CurveSample(
                (stage.now_us - start_us) / 1e6,
                _number(stage.get(_POTENTIOMETER)),
                int(_number(stage.get(_REFERENCE))),
                _number(stage.get(_SHAFT)),
            )
            if (at_us - begin_us) % _PERIOD_US < stage.step_us:
                echo(_row(sample))
            samples.append(sample)
        begin_us += act.duration_us
        if act.is_step:
            echo(_arrival(samples[first:]))
    return samples


def _arrival(samples: list[CurveSample]) -> str:
    """Return the final angle, and the time at which it came within 0.01 deg of the reference."""
    wanted = samples[-1].reference_deg
    late = [sample for sample in samples if abs(sample.angle_deg - wanted) > _AT_REST_DEG]
    after_s = (late[-1].time_s if late else samples[0].time_s) - samples[0].time_s
    rest_deg = samples[-1].angle_deg
    return f"The shaft rests at {rest_deg:.4f} deg, {after_s:.3f} s after the step."


def _number(value: Setting) -> float:
    assert not isinstance(value, str)
    return value
