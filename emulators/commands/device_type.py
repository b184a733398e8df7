"""Device types: build, connect and show a device on a serial line (docs/howto/extending.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from tickrig.emulators.fields import DeviceField, read_config
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.serial.emulator import Emulator, LineSettings
from tickrig.host.cli.extensions import ExtensionGroup
from tickrig.host.text.trace import Config, Header
from tickrig.host.text.user_file import SUFFIX, explain_error

if TYPE_CHECKING:
    import click

    from tickrig.emulators.scenario import Encoder, Sender

_SEED: Final = "seed"
"""Key in traces for wire faults. A replay does not need it, because it has the resulting
traffic."""

_MEMBERS: Final = ("tick_us", "due_us", "reset", "tick", "inputs", "outputs", "read")
"""Interface of a device on a serial line (docs/howto/extending.md)."""


def by_miniterm(link: str, baud: int) -> str:
    """Return a hint for users: the command line with which a terminal program reaches the device.

    The program is miniterm, which comes with pyserial. It suits devices with lines of text.

    Args:
        link: path of the terminal of the device.
        baud: bit rate in bit/s.
    """
    return f" Talk to it with\n  python -m serial.tools.miniterm --eol LF -e {link} {baud}"


def _field_of_option(option: click.Option) -> DeviceField:
    """Return the field of a `click.Option`, which device types of tickrig 0.1 declare.

    A type that is not one of click's numbers and choices becomes a text.
    """
    kinds: dict[str, type[str | int | float]] = {"integer": int, "float": float}
    kind = bool if option.is_flag else kinds.get(option.type.name.partition(" ")[0], str)
    default = option.default
    return DeviceField(
        name=str(option.name),
        kind=kind,
        option=option.opts[0].removeprefix("--"),
        low=getattr(option.type, "min", None),
        high=getattr(option.type, "max", None),
        choices=tuple(getattr(option.type, "choices", ())),
        unit=option.metavar or "",
        default=default if isinstance(default, str | int | float | tuple | list) else None,
        many=option.multiple,
        help=option.help or "",
    )


@dataclass(frozen=True, kw_only=True)
class DeviceType:
    """A type of device on a serial line: an entry point of the group `tickrig.devices`.

    Attributes:
        name: name of the type in traces and for `tickrig emu`.
        title: title as readable text.
        build: function that makes a device from the configuration in a trace. It raises ValueError
            if the configuration is invalid.
        text: sentence for `tickrig emu --help`.
        fields: options on the command line and in rig files. Their values are the configuration.
        options: options as click options, which were used before `fields` existed. They become
            fields.
        configure: function for further processing of a command line; see `Configure`.
        line: baud rate, wire faults, and rule that splits the traffic for the log.
        encoders: further verbs of scenarios that send a line.
        senders: sending verbs of scenarios, if the line does not carry text.
        is_event: function that selects the lines that -v shows.
        panel: function that runs the operator panel until it is closed.
        talk: function that returns the instructions for talking to the device at a path and a baud
            rate.
        config_of: function that returns the configuration of a device made by a program, or None if
            the device cannot be rebuilt from a configuration.
        user_code: `FILE.py:Class` whose errors are reported in one line, if the device runs such
            code.
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
        """Convert options of click to fields."""
        object.__setattr__(self, "fields", (*self.fields, *map(_field_of_option, self.options)))

    def of_options(self, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
        """Make a device of this type with the options of a command line or a rig file.

        Args:
            options: values of the fields of the type.
            seed: seed of all random numbers.

        Raises:
            ValueError: the device cannot be made.
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
        """Make a device of this type with the settings that a trace has recorded.

        Args:
            config: configuration of the device in the trace.

        Returns:
            The device in its state at the start of the recording.

        Raises:
            ValueError: the configuration is invalid.
        """
        settings = {name: value for name, value in config.items() if name != _SEED}
        if self.configure is None:
            known = {each.name: each.default for each in self.fields}
            check_config(settings, known, f"{self.title} has no setting", typed=False)
        return self.build(settings)


@dataclass(frozen=True)
class ConfiguredDevice:
    """A device that was made from a command line or a rig file, with its settings.

    Attributes:
        type: type of the device. Options of the command line can change the type. For example, the
            option `--node` of an RTC-Lite node changes the title of the type and the verbs for
            scenarios.
        device: the device.
        config: all settings of the device, which a trace records.
    """

    type: DeviceType
    device: Emulated[bytes]
    config: Config


Configure = Callable[[DeviceType, Mapping[str, Any], int], ConfiguredDevice]
"""Function that makes a device from its type, its options and a seed."""

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
"""The available device types."""


def configure(name: str, config: Mapping[str, object], seed: int = 0) -> ConfiguredDevice:
    """Make a device of a given type with given settings, as a rig file does.

    Args:
        name: name of the device type.
        config: settings by the name of their option on the command line, without dashes; see
            `read_config`.
        seed: seed of the device's random numbers.

    Raises:
        ExtensionError: the type is unknown, or cannot be loaded.
        ValueError: a field is unknown, or a value is invalid. The message starts with the field.

    >>> configure("rtc-lite", {"node": "lite-a"}).config["node"]
    'lite-a'
    """
    device_type = DEVICES.load(name)
    return device_type.of_options(read_config(name, device_type.fields, config), seed)


def option_names(name: str) -> tuple[str, ...]:
    """Return the names of the options that a device type has, without dashes.

    Raises:
        ExtensionError: the type is unknown, or cannot be loaded.
    """
    return tuple(field.word for field in DEVICES.load(name).fields)


def build_recorded(header: Header, *, run_code: bool = False) -> Emulated[bytes]:
    """Make a new device with the settings of the device on which a trace was recorded.

    A replay sends the recorded input to this new device.

    Args:
        header: header of the trace.
        run_code: whether to run a Python file that the trace names.

    Raises:
        ValueError: the device type is unknown, or the configuration is invalid.
    """
    check_no_code(header.config.values(), run_code=run_code)
    if header.device not in DEVICES.built_in and header.device not in DEVICES.names():
        known = ", ".join(DEVICES.names())
        raise ValueError(f"recorded on {header.device!r}; this program knows {known}")
    return DEVICES.load(header.device).of_trace(header.config)


def check_no_code(named: Iterable[object], *, run_code: bool) -> None:
    """Raise ValueError if a replay of a trace would run a Python file without permission.

    Args:
        named: values from the trace, such as the values of settings. A text `FILE.py:Class` names
            Python code.
        run_code: whether the user has allowed this code with `--run-code`.

    Raises:
        ValueError: the trace names a `FILE.py:Class`, and `run_code` does not allow it.
    """
    for name in named:
        if isinstance(name, str) and f"{SUFFIX}:" in name and not run_code:
            raise ValueError(f"it names Python code, {name!r:.80}; --run-code runs it")


def check_config(config: Config, defaults: Config, owner: str, *, typed: bool = True) -> None:
    """Check that a configuration from a trace has only settings that the device has.

    Args:
        config: the configuration, as in a trace.
        defaults: all settings of the device with their defaults.
        owner: text before the name of an unknown setting in the error message, such as `an RRC has
            no setting`.
        typed: whether a value must have the type of its default.

    Raises:
        ValueError: a setting is unknown, or its value has another type.
    """
    for name, value in config.items():
        if name not in defaults:
            raise ValueError(f"{owner} {name!r}; known: {', '.join(defaults)}")
        if typed and type(value) is not type(defaults[name]):
            raise ValueError(f"{name} is {value!r}, expected is something like {defaults[name]!r}")
