"""Sources of the node under test, which are a python-can bus or a rig file in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.host.canmon.sources.source import BusSpec, FileSpec, LineSpec, parse_source
from tickrig.host.canopen.conform.check import Stimulus
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.extensions import ExtensionError, ExtensionGroup
from tickrig.host.cli.messages import Refused, SourceFailed, refuse_path, say
from tickrig.host.links.link import LinkClosed

if TYPE_CHECKING:
    from tickrig.host.canmon.sources import bus_source
    from tickrig.host.canopen.conform.binding.capabilities import NodeDescription
    from tickrig.host.canopen.conform.conform_run import ConformRun
    from tickrig.host.links import can_link, echo
    from tickrig.host.links.link import StampedLink
else:  # python-can is slow; slow; with it
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")
    can_link = LazyModule("tickrig.host.links.can_link")
    echo = LazyModule("tickrig.host.links.echo")

RIG_FILE: Final = ".toml"

_RIGS: Final = ExtensionGroup[Any](
    "tickrig.conform_sources",
    "source",
    {"rig": "tickrig.emulators.testing.conformance.bench_source:open_rig"},
    callable,
    "a function",
)
"""Module and name of the function that opens a rig file. Hosts must not import emulators."""


_LOCAL: Final = ("virtual", "udp_multicast")
"""Interfaces of python-can whose bus connects processes, mostly processes of one machine."""


@dataclass(frozen=True, slots=True)
class ConformSource:
    """An open bus with the node under test.

    Attributes:
        link: connection to the bus.
        name: name of the bus for messages.
        adapter: description of the adapter.
        bit_rate: bit rate of the bus in bit/s, or None if unknown.
        virtual: whether the bus has no other participants and runs in virtual time.
        shared_host: whether the nodes of the bus may be processes of this machine.
        nodes: known nodes by node-ID.
        eds: name of the EDS of each node, by node-ID. The files need not exist.
        describe: function that returns the known description of a node, or None if the node has no
            EDS.
        stimulus: function that makes the stimuli of a node, or None if there are none.
        close: function that closes the bus.
        watch: function that reports disturbances of the bus, and exceptions that nodes raise, to a
            run.
    """

    link: StampedLink
    name: str
    adapter: str
    bit_rate: int | None = None
    virtual: bool = False
    shared_host: bool = False
    nodes: dict[int, str] = field(default_factory=dict)
    eds: dict[int, str] = field(default_factory=dict)
    describe: Callable[[int], NodeDescription | None] = lambda node_id: None
    stimulus: Callable[[int], Stimulus] | None = None
    close: Callable[[], object] = lambda: None
    watch: Callable[[int, ConformRun], None] = lambda node_id, run: None


def open_conform_source(
    word: str | None, node_id: int | None, options: BusOptions
) -> ConformSource:
    """Open the CAN bus or the rig file on which `canmon conform` tests a node.

    Args:
        word: SOURCE argument of the command line, such as `can0`, `slcan:/dev/ttyACM0@500k` or a
            rig file `bench.toml`, or None if the options name a bus.
        node_id: node-ID of the node under test. If the rig has several buses, the bus with this
            node is used. None selects the first bus.
        options: bus options of the command line, such as interface and bit rate.

    Raises:
        Refused: the source is not a bus with nodes, for example a log file.
        SourceFailed: the source cannot be opened.
    """
    if word is None and not options:
        raise Refused("no SOURCE: name a bus as can0, or a rig file as bench.toml")
    if word is not None and word.lower().endswith(RIG_FILE):
        if words := options.arguments():
            raise Refused(f"{words[0]} is of a bus: in {word} the rig file says what the bus is")
        return _open_rig(Path(word), node_id)
    spec = BusSpec() if word is None else _parse(word)
    if spec is None or isinstance(spec, FileSpec):
        raise Refused(
            f"SOURCE {word!r} is no bus: a log holds what was said, and answers nothing;"
            " canmon check holds it against rules"
        )
    if not isinstance(spec, BusSpec) or spec.chosen is not None:
        raise Refused(f"SOURCE {word!r} is no whole CAN bus as can0 or slcan:/dev/ttyACM0@500k")
    return _open_bus(spec, options)


def _parse(word: str) -> FileSpec | BusSpec | LineSpec | None:
    try:
        return parse_source(word)
    except Refused:
        if Path(word).is_file():
            text = f"SOURCE {word!r} is neither a bus as can0 nor a rig file as bench.toml"
            raise Refused(text) from None
        raise


def _open_rig(path: Path, node_id: int | None) -> ConformSource:
    try:
        source: ConformSource = _RIGS.load("rig")(path, node_id)
    except OSError as error:
        refuse_path("rig", error)
    except (ExtensionError, ValueError) as error:
        raise Refused(str(error)) from None
    return source


def _open_bus(spec: BusSpec, options: BusOptions) -> ConformSource:
    given = bus_source.merged(spec, options)
    bus, interface, name = bus_source.open_bus(given)
    try:
        link = can_link.CanLink(bus, name)
    except LinkClosed as error:
        can_link.close_bus(bus)
        raise SourceFailed(str(error)) from None
    link.reads.on_fault = say
    return ConformSource(
        echo.free_of_echo(link, interface),
        name,
        interface,
        given.bitrate,
        shared_host=_is_local(interface, given.channel),
        close=link.close,
        watch=partial(_watch_errors, link),
    )


def _is_local(interface: str, channel: object) -> bool:
    """Return whether a bus connects processes of this machine, as vcan does."""
    if interface in _LOCAL:
        return True
    net = Path("/sys/class/net", str(channel))
    return interface == "socketcan" and net.exists() and not (net / "device").exists()


def _watch_errors(link: can_link.CanLink, node_id: int, run: ConformRun) -> None:
    def disturb(text: str) -> None:
        say(text)
        run.disturb("the driver could not read a frame")

    link.on_error_frame = lambda error: run.disturb("error frames on the bus")
    link.reads.on_fault = disturb
