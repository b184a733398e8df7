from __future__ import annotations

import click
import pytest

from tickrig.emulators.commands.device_type import DEVICES, DeviceType, configure, option_names
from tickrig.emulators.commands.emu_cli import device_command
from tickrig.emulators.fields import DeviceField, read_config
from tickrig.host.cli.extensions import ExtensionError


@pytest.mark.parametrize("name", ["rrc", "rtc-lite", "rh3-base", "urg", "ucode-reader"])
def test_a_device_of_no_options_is_as_on_the_command_line(name: str) -> None:
    made = configure(name, {})
    assert type(made.device) is type(made.type.of_trace(made.config))


def test_options_are_those_of_the_command_line() -> None:
    assert option_names("rtc-lite") == ("node", "baud", "timer", "framing", "checksum")
    made = configure("rtc-lite", {"node": "lite-b", "timer": 10, "baud": 9_600})
    assert (made.config["rate_hz"], made.type.line.baud) == (10, 9_600)


def test_what_may_be_repeated_is_a_list() -> None:
    made = configure("urg", {"room": "4,3", "post": ["1,0,0.1", "2,0,0.1"]})
    assert made.config["posts"] == "1.0,0.0,0.1 2.0,0.0,0.1"


@pytest.mark.parametrize(
    ("name", "config", "text"),
    [
        ("rrc", {"color": "red"}, "color: rrc has no such option; known: power-on-event"),
        ("rrc", {"panel": True}, "panel: rrc has no such option"),
        ("rrc", {"power_on_event": "Bang"}, "--power-on-event.*'Bang' is not one of"),
        ("rrc", {"battery_wh": 500}, "--battery-wh does nothing without --vehicle"),
        ("urg", {"noise": 1}, "--noise does nothing without --room, --wall or --post"),
        ("rtc-lite", {"baud": 1}, "--baud.*1 is not in the range 300<=x<=4000000"),
        ("rtc-lite", {"node": "nobody"}, "no node 'nobody'; known: echo"),
        ("rtc-lite", {"node": ["echo"]}, "node: it is given once, not as a list"),
        ("urg", {"post": [True]}, "post: True is not a number or a text"),
        ("urg", {"post": "1,2"}, "--post.*a post is X,Y,RADIUS"),
        ("rh3-base", {"friction": "--help"}, "--friction.*'--help' is not a valid float"),
    ],
)
def test_a_mistake_is_told(name: str, config: dict[str, object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        configure(name, config)


def test_an_unknown_type_is_told() -> None:
    with pytest.raises(ExtensionError, match="teapot"):
        configure("teapot", {})


TRIED = (
    "",
    "x",
    "-1",
    "0",
    "1",
    "0.5",
    "1.1",
    "300",
    "9600",
    "1e3",
    "nan",
    "inf",
    "4000001",
    " 7 ",
)


NEEDED: dict[tuple[str, str], dict[str, object]] = {
    ("rrc", "battery-wh"): {"vehicle": True},
    ("urg", "noise"): {"room": "4,3"},
}
"""What an option does nothing without."""


def typed(device_type: DeviceType, word: str, text: str) -> tuple[object, str]:
    """Return what the command line makes of a value, or why it refuses it."""
    command = click.Command("emu", params=device_command(device_type).params)
    try:
        with command.make_context("emu", [f"--{word}={text}"]) as context:
            name = next(each.name for each in device_type.fields if each.word == word)
            return context.params[name], ""
    except click.ClickException as error:
        return None, error.format_message().replace("'", "", 2)


@pytest.mark.parametrize("name", DEVICES.built_in)
@pytest.mark.parametrize("text", TRIED)
def test_a_rig_file_reads_a_value_as_the_command_line_does(name: str, text: str) -> None:
    device_type = DEVICES.load(name)
    for field in device_type.fields:
        if field.kind is bool:  # a flag has no value on a command line
            continue
        try:
            config = {field.word: text, **NEEDED.get((name, field.word), {})}
            read = read_config(name, device_type.fields, config)
            found = read[field.name], ""
        except ValueError as error:
            found = None, f"Invalid value for {error}"
        assert repr(found) == repr(typed(device_type, field.word, text))


@pytest.mark.parametrize("name", DEVICES.built_in)
def test_what_is_left_out_is_as_on_the_command_line(name: str) -> None:
    device_type = DEVICES.load(name)
    command = click.Command("emu", params=device_command(device_type).params)
    with command.make_context("emu", []) as context:
        plain = {each.name: context.params[each.name] for each in device_type.fields}
    assert read_config(name, device_type.fields, {}) == plain


LAMP = (
    DeviceField(name="is_bright", kind=bool, help="Bright."),
    DeviceField(name="watts", kind=float, high=60, many=True),
    DeviceField(name="base", choices=("E27",)),
)


@pytest.mark.parametrize(
    ("config", "text"),
    [
        ({"is-bright": 1}, "is-bright: 1 is not true or false"),
        ({"watts": [61]}, "--watts: 61.0 is not in the range x<=60."),
        ({"base": "E14"}, "--base: 'E14' is not 'E27'."),
    ],
)
def test_a_value_of_another_kind_is_refused(config: dict[str, object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        read_config("lamp", LAMP, config)


def test_a_flag_and_a_list_are_read() -> None:
    read = read_config("lamp", LAMP, {"is_bright": True, "watts": [40, 60]})
    assert read == {"is_bright": True, "watts": (40.0, 60.0), "base": None}


def test_options_of_click_are_fields_too() -> None:
    options = (
        click.Option(["--power-w"], type=click.IntRange(100, 3_000), default=2_000, help="W."),
        click.Option(["--lid/--no-lid", "lid"], is_flag=True),
        click.Option(["--ring"], type=click.Choice(["a", "b"]), multiple=True, metavar="R"),
    )
    kettle = DeviceType(name="k", title="K", build=lambda config: None, options=options)  # type: ignore[arg-type, return-value]
    power = DeviceField(
        name="power_w", kind=int, low=100, high=3_000, default=2_000, help="W.", option="power-w"
    )
    ring = DeviceField(name="ring", option="ring", choices=("a", "b"), unit="R", many=True)
    assert kettle.fields == (power, DeviceField(name="lid", option="lid", kind=bool), ring)
