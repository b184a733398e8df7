"""Options of a CAN bus as in the tools of python-can, and the bus itself.

python-can is imported only when a bus is opened, because the import takes a fifth of a second.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import click
from click.shell_completion import CompletionItem

from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.cli.options import Decorator, HarmlessCommand, add_options
from tickrig.host.cli.start import loading
from tickrig.host.text.values import parse_setting

if TYPE_CHECKING:
    import can

GREEDY: Final = ("--timing", "--bus-kwargs")
"""Options with one or more values in python-can's tools."""

"""Message of python-can if its interface udp_multicast lacks a package."""

UNNAMED: Final = '"None"'
"""Part of the message of python-can if no interface is given."""

_PLAIN: Final = ("interface", "channel", "bitrate")
_BIT_RATE: Final = re.compile(r"([0-9]{1,9})([kM]?)", re.ASCII)
_FACTORS: Final = {"": 1, "k": 1_000, "M": 1_000_000}

_KEY_VALUE: Final = re.compile(r"([A-Za-z_][\w-]*)=(\S*)", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class BusOptions:
    """The options of a command line that select a CAN bus."""

    interface: str | None = None
    channel: str | None = None
    bitrate: int | None = None
    timing: tuple[str, ...] = ()
    bus_kwargs: tuple[str, ...] = ()
    fd: bool = False
    data_bitrate: int | None = None

    def __bool__(self) -> bool:
        """Return whether an outside bus is requested."""
        return bool(self.interface or self.channel or self.timing or self.bus_kwargs)

    def arguments(self) -> list[str]:
        """Return the options as words for another command line."""
        words = [f"--{name}={value}" for name in _PLAIN if (value := getattr(self, name))]
        for option, values in zip(GREEDY, (self.timing, self.bus_kwargs), strict=True):
            words += [option, *values] if values else []
        words += ["--fd"] * self.fd
        return words + [f"--data-bitrate={self.data_bitrate}"] * bool(self.data_bitrate)


def parse_bit_rate(text: str) -> int:
    """Parse a bit rate of the command line, such as 500000, 500k or 1M. Return it in bit/s.

    Raises:
        ValueError: the text is not a bit rate.

    >>> parse_bit_rate("500k"), parse_bit_rate("1M"), parse_bit_rate("125000")
    (500000, 1000000, 125000)
    """
    match = _BIT_RATE.fullmatch(text)
    if match is None or not int(match[1]):
        raise ValueError(f"{text!r} is not a bit rate like 500000, 500k or 1M")
    return int(match[1]) * _FACTORS[match[2]]


class _BitRate(click.ParamType):  # type: ignore[type-arg] # generic since click 8.4 only
    """A bit rate on the command line."""

    name = "bit rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Read a bit rate."""
        try:
            return parse_bit_rate(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


class BusCommand(HarmlessCommand):
    """Click command whose options `--timing` and `--bus-kwargs` accept several words KEY=VALUE.

    Do not use this class for a command whose own arguments have the form KEY=VALUE.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, with such an option repeated before each of its values."""
        return super().parse_args(ctx, spread(args))


def spread(args: Sequence[str]) -> list[str]:
    """Insert an option again before each further KEY=VALUE, for options that accept several.

    >>> spread(["--bus-kwargs", "a=1", "b=2", "can0", "c=3"])
    ['--bus-kwargs', 'a=1', '--bus-kwargs', 'b=2', 'can0', 'c=3']
    """
    out: list[str] = []
    greedy, given = "", False
    for word in args:
        if word.startswith("-"):
            greedy, given = (word if word in GREEDY else ""), False
        elif given and _KEY_VALUE.fullmatch(word):
            out.append(greedy)
        else:
            given = bool(greedy) and not given
            greedy = greedy if given else ""
        out.append(word)
    return out


def _complete_interface(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    return [CompletionItem(name) for name in _interfaces() if name.startswith(begun)]


def _interfaces() -> list[str]:
    with loading():
        import can  # noqa: PLC0415 - slow

    return sorted(can.VALID_INTERFACES)


bus_options: Final[Decorator] = add_options(
    click.option(
        "-i",
        "--interface",
        metavar="INTERFACE",
        shell_complete=_complete_interface,
        help="Driver of python-can, such as socketcan, udp_multicast, slcan.",
    ),
    click.option("-c", "--channel", metavar="CHANNEL", help="Channel, such as can0."),
    click.option(
        "-b",
        "--bitrate",
        type=_BitRate(),
        metavar="BITRATE",
        help="Bit rate in bit/s, such as 500000 or 500k.",
    ),
    click.option(
        "--timing",
        multiple=True,
        metavar="KEY=VALUE...",
        help="Bit timing, such as f_clock=8000000 tseg1=5 tseg2=2 sjw=2 brp=2 nof_samples=1.",
    ),
    click.option(
        "--bus-kwargs",
        multiple=True,
        metavar="KEY=VALUE...",
        help="Further driver options, such as port=43113.",
    ),
)
"""Decorator that adds the fields of `BusOptions` as options.

The command's class is `BusCommand`.
"""


fd_options: Final[Decorator] = add_options(
    click.option("--fd", is_flag=True, help="Send and receive CAN FD."),
    click.option(
        "--data-bitrate",
        type=_BitRate(),
        metavar="BITRATE",
        help="Data bit rate of CAN FD frames with BRS, such as 2M, for the load and (with --fd)"
        " the driver.",
    ),
)
"""Decorator that adds the CAN FD fields of `BusOptions`, in addition to `bus_options`."""


def bus_and_rest(
    words: Sequence[str], channel: str | None, rest: str, most: int | None = None
) -> tuple[str | None, list[str]]:
    """Split the arguments of a command into the bus and the words after it.

    If the option -c names the bus, the arguments contain no bus.

    Args:
        words: arguments of the command.
        channel: value of the option -c, or None if it is not given.
        rest: name of the words after the bus, for error messages.
        most: maximum number of words after the bus, or None for any number.

    Returns:
        The bus, and the words after the bus. If the option -c names the bus, the first value is
        None.

    Raises:
        click.UsageError: an argument is missing, or there are too many.
    """
    bus, behind = (None, [*words]) if channel is not None else (words[0], [*words[1:]])
    if not behind:
        raise click.UsageError(f"Missing argument '{rest}'.")
    if most is not None and len(behind) > most:
        hint = f": -c {channel} names the bus" if channel is not None else ""
        raise click.UsageError(f"Got unexpected extra argument ({' '.join(behind[most:])}){hint}")
    return bus, behind


def open_raw(options: BusOptions, instead: str = "") -> tuple[can.BusABC, str, str | None]:
    """Open the CAN bus that the command line names, with python-can.

    Args:
        options: bus options of the command line.
        instead: other arguments that the user can give instead of a bus. The error message mentions
            them if no bus is named.

    Returns:
        The bus, its interface and its channel.

    Raises:
        Refused: the command line names no bus.
        SourceFailed: the bus cannot be opened.
    """
    with loading():
        import can  # noqa: PLC0415 - slow
        from can.util import load_config  # noqa: PLC0415

    from tickrig.host.links.can_link import bus_reason, prepare_bus  # noqa: PLC0415

    check_interface(options.interface)
    given = _given(options)
    try:
        config = load_config(config=dict(given))
    except can.CanInterfaceNotImplementedError as error:
        unnamed = UNNAMED in str(error)
        raise Refused(
            _nothing_named(instead) if unnamed else f"CAN bus: {_first_line(error)}"
        ) from None
    except (ValueError, TypeError) as error:
        raise Refused(f"CAN bus: {_first_line(error)}") from None
    interface, channel = str(config["interface"]), config["channel"]
    try:
        bus = can.Bus(**{"single_handle": True, **given})
        prepare_bus(bus, interface)
    except Exception as error:  # its drivers raise whatever they come across, NameError even
        _let_go(error)
        name = interface if channel is None else f"{interface} {channel}"
        raise SourceFailed(f"CAN bus {name}: {bus_reason(error)}") from None
    return bus, interface, channel


def _let_go(error: Exception) -> None:
    """Drop an incomplete bus without python-can's warning that it was not closed."""
    import logging  # noqa: PLC0415 - rarely wanted
    from traceback import clear_frames  # noqa: PLC0415

    log = logging.getLogger("can.bus")
    log.disabled = True
    clear_frames(error.__traceback__)
    log.disabled = False


def check_interface(interface: str | None) -> None:
    """Raise Refused for an interface that python-can does not have."""
    if interface is not None and interface not in (names := _interfaces()):
        from tickrig.host.text.names import closest  # noqa: PLC0415 - only for mistakes

        meant = "".join(f"; did you mean {word!r}?" for word in closest(interface, names))
        known = ", ".join(names)
        raise Refused(f"-i {interface!r} is not an interface of python-can: {known}{meant}")


def _given(options: BusOptions) -> Mapping[str, Any]:
    given: dict[str, Any] = {
        key: value for key in _PLAIN if (value := getattr(options, key)) is not None
    }
    given.update(_pairs("--bus-kwargs", options.bus_kwargs, parse_setting))
    if options.fd:
        given["fd"] = True
        given |= {"data_bitrate": options.data_bitrate} if options.data_bitrate else {}
    if options.timing:
        given["timing"] = _timing(_pairs("--timing", options.timing, int))
    return given


def _pairs(option: str, words: Sequence[str], parse: Callable[[str], Any]) -> dict[str, Any]:
    pairs = {}
    for word in words:
        match = _KEY_VALUE.fullmatch(word)
        try:
            if match is None:
                raise ValueError
            pairs[match[1].replace("-", "_")] = parse(match[2])
        except ValueError:
            raise Refused(f"{option} {word!r} is not KEY=VALUE") from None
    return pairs


def _timing(pairs: Mapping[str, Any]) -> can.BitTiming:
    import can  # noqa: PLC0415 - slow

    try:
        return can.BitTiming(**pairs)
    except (TypeError, ValueError) as error:
        raise Refused(f"--timing: {_first_line(error)}") from None


def _nothing_named(instead: str) -> str:
    names = ", ".join(_interfaces())
    return (
        "no CAN bus is given: give -i INTERFACE -c CHANNEL, set CAN_INTERFACE and CAN_CHANNEL, or"
        f" write them into ~/.canrc{instead and f'; or {instead}'}."
        f" python-can has {names}"
    )


def _first_line(error: BaseException) -> str:
    from tickrig.host.links.link import first_line  # noqa: PLC0415 - a TAB needs none

    return first_line(error)
