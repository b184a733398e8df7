from __future__ import annotations

import pytest

from tickrig.emulators.commands.device_config import configure, option_names
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
