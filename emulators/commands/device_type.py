"""Device types: what builds, connects and shows a device on a line (docs/howto/extending.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from tickrig.emulators.fields import DeviceField, field_of_option, read_config
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.scenario import Encoder, Sender
from tickrig.emulators.serial.emulator import Emulator, LineSettings
from tickrig.host.cli.extensions import ExtensionGroup
from tickrig.host.text.trace import Config, Header
from tickrig.host.text.user_file import SUFFIX, explain_error

if TYPE_CHECKING:
    import click

_SEED: Final = "seed"
"""In a trace, that of the wire's faults: a replay has none, what came through is recorded."""

_MEMBERS: Final = ("tick_us", "due_us", "reset", "tick", "inputs", "outputs", "read")
"""What a device on a line has (docs/howto/extending.md)."""


def by_miniterm(link: str, baud: int) -> str:
    """Say how to talk to a device of lines of text; miniterm comes with pyserial."""
    return f" Talk to it with\n  python -m serial.tools.miniterm --eol LF -e {link} {baud}"


@dataclass(frozen=True, kw_only=True)
class DeviceType:
    """A type of device on a serial line: an entry point of the group `tickrig.devices`.

    Attributes:
        name: what traces and `tickrig emu` call it.
        title: for people.
        build: makes a device of the configuration that a trace carries; ValueError if it cannot be.
        text: one sentence for `tickrig emu --help`.
        fields: what can be set of it, on its command line and in rig files; their values are the
            configuration.
        options: the same as options of click, as before `fields`; they become fields.
        configure: what else a command line makes of them; see `Configure`.
        line: baud rate, wire faults, and how the log cuts what passes.
        encoders: further verbs of its scenarios that send a line.
        senders: the verbs of its scenarios that send, where the line carries no text.
        is_event: which lines -v shows.
        panel: runs the operator panel until it is left.
        talk: says how to talk to it at a path and a baud rate.
        config_of: the configuration of a device that a program has made itself, None if it cannot
            be made again of one.
        user_code: `FILE.py:Class` whose mistakes are told in a line, if it runs such.
    """

    name: str
    title: str
    build: Callable[[Config], Emulated[bytes]]
    text: str = ""
    fields: tuple[DeviceField, ...] = ()
    options: tuple[click.Option, ...] = ()
    configure: Configure | None = None
    line: LineSettings = field(default_factory=LineSettings)
    encoders: Mapping[str, Encoder] = field(default_factory=dict)
    senders: Mapping[str, Sender] | None = None
    is_event: Callable[[WireLine], bool] = lambda line: True
    panel: Callable[[Emulator], None] | None = None
    talk: Callable[[str, int], str] = by_miniterm
    config_of: Callable[[Any], Config | None] = lambda device: None
    user_code: str = ""

    def __post_init__(self) -> None:
        """Make fields of what is declared as options of click."""
        object.__setattr__(self, "fields", (*self.fields, *map(field_of_option, self.options)))

    def of_options(self, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
        """Make the device that a command line or a rig file asks for.

        Args:
            options: the values of its fields.
            seed: of all chance.

        Raises:
            ValueError: it cannot be made.
        """
        if self.configure is not None:
            return self.configure(self, options, seed)
        try:
            device = self.build(options)
        except ValueError:
            raise  # it says what is wrong
        except Exception as error:  # of another package, it may raise anything
            raise ValueError(f"{self.name} cannot be built: {explain_error(error)}") from error
        if missing := [name for name in _MEMBERS if not hasattr(device, name)]:
            kind = type(device).__name__
            raise ValueError(f"{self.name}: {kind} has no {', '.join(missing)}")
        return ConfiguredDevice(self, device, options)

    def of_trace(self, config: Config) -> Emulated[bytes]:
        """Make the device that a trace was recorded on.

        Args:
            config: what the trace says of it.

        Returns:
            The device, as it was when the recording began.

        Raises:
            ValueError: it cannot be made of that.
        """
        settings = {name: value for name, value in config.items() if name != _SEED}
        if self.configure is None:
            known = {each.name: each.default for each in self.fields}
            check_config(settings, known, f"{self.title} has no setting", typed=False)
        return self.build(settings)


@dataclass(frozen=True)
class ConfiguredDevice:
    """A device as a command line asks for it.

    Attributes:
        type: its type, with what its options change of that.
        device: the device.
        config: all its settings, for the trace.
    """

    type: DeviceType
    device: Emulated[bytes]
    config: Config


Configure = Callable[[DeviceType, Mapping[str, Any], int], ConfiguredDevice]
"""Makes a device of its type, its options and a seed."""

DEVICES: Final = ExtensionGroup[DeviceType](
    name="tickrig.devices",
    what="device",
    built_in={
        "rrc": "tickrig.emulators.rrc.device_type:RRC",
        "rtc-lite": "tickrig.emulators.rtc_lite.device_type:RTC_LITE",
        "rh3-base": "tickrig.emulators.rh3.device_type:RH3_BASE",
        "urg": "tickrig.emulators.urg.device_type:URG",
        "ucode-reader": "tickrig.emulators.tkernel.reader.device_type:UCODE_READER",
    },
    accepts=lambda found: isinstance(found, DeviceType),
    wanted="a DeviceType",
)
"""The device types that there are."""


def configure(name: str, config: Mapping[str, object], seed: int = 0) -> ConfiguredDevice:
    """Make a device of its type and of values for its fields, as a rig file gives them.

    Args:
        name: of the device type.
        config: values by the names of command lines, without their dashes; see `read_config`.
        seed: of all chance in it.

    Raises:
        ExtensionError: there is no such type, or it cannot be loaded.
        ValueError: no such field, or not with this value; the text begins with the field.

    >>> configure("rtc-lite", {"node": "lite-a"}).config["node"]
    'lite-a'
    """
    device_type = DEVICES.load(name)
    return device_type.of_options(read_config(name, device_type.fields, config), seed)


def option_names(name: str) -> tuple[str, ...]:
    """Return the options of a device type without their dashes; ExtensionError if there is none."""
    return tuple(field.word for field in DEVICES.load(name).fields)


def build_recorded(header: Header, *, run_code: bool = False) -> Emulated[bytes]:
    """Build the device that a trace was recorded on.

    Args:
        header: of the trace.
        run_code: whether to run a Python file that it names.

    Raises:
        ValueError: there is none of this name, or its configuration cannot be.
    """
    check_no_code(header.config.values(), run_code=run_code)
    if header.device not in DEVICES.built_in and header.device not in DEVICES.names():
        known = ", ".join(DEVICES.names())
        raise ValueError(f"recorded on {header.device!r}; this program knows {known}")
    return DEVICES.load(header.device).of_trace(header.config)


def check_no_code(named: Iterable[object], *, run_code: bool) -> None:
    """Refuse Python files that a trace names: who replays a trace does not expect to run a program.

    Raises:
        ValueError: there is a `FILE.py:Class`, and `run_code` does not allow it.
    """
    for name in named:
        if isinstance(name, str) and f"{SUFFIX}:" in name and not run_code:
            raise ValueError(f"it names Python code, {name!r:.80}; --run-code runs it")


def check_config(config: Config, defaults: Config, owner: str, *, typed: bool = True) -> None:
    """Raise ValueError unless a configuration has settings of a device alone.

    Args:
        config: as a trace carries it.
        defaults: all settings that there are.
        owner: what has them, for people: `an RRC has no setting`.
        typed: whether a value has to be of the type of its default.
    """
    for name, value in config.items():
        if name not in defaults:
            raise ValueError(f"{owner} {name!r}; known: {', '.join(defaults)}")
        if typed and type(value) is not type(defaults[name]):
            raise ValueError(f"{name} is {value!r}, expected is something like {defaults[name]!r}")
