from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import can
import click
import pytest
from click.testing import CliRunner

from tickrig.emulators.testing.commands.canopen_run import open_bus
from tickrig.host.cli.can_options import GREEDY, BusCommand, BusOptions, bus_options, open_raw
from tickrig.host.cli.messages import Refused, SourceFailed


@pytest.fixture(autouse=True)
def nothing_configured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No configuration of whoever runs the tests."""
    monkeypatch.setattr("can.util.CONFIG_FILES", [str(tmp_path / "canrc")])
    for name in ("CAN_INTERFACE", "CAN_CHANNEL", "CAN_BITRATE", "CAN_CONFIG"):
        monkeypatch.delenv(name, raising=False)


def opened(**options: Any) -> tuple[str, str]:
    with ExitStack() as stack:
        _, name, channel = open_bus(BusOptions(**options), stack)
        return name, channel


def refused(**options: Any) -> str:
    with ExitStack() as stack, pytest.raises(Refused) as caught:
        open_bus(BusOptions(**options), stack)
    return caught.value.message


def failed(**options: Any) -> str:
    """Return the message of a bus that cannot be opened: exit status 3."""
    with ExitStack() as stack, pytest.raises(SourceFailed) as caught:
        open_bus(BusOptions(**options), stack)
    return caught.value.message


def test_a_bus_is_named_on_the_command_line() -> None:
    assert opened(interface="virtual", channel="a b") == ("virtual a b", "a_b")
    assert opened(interface="virtual") == ("virtual", "virtual")


def test_a_bus_is_named_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "virtual")
    monkeypatch.setenv("CAN_CHANNEL", "7")
    assert opened() == ("virtual 7", "7")
    assert opened(channel="8") == ("virtual 8", "8")


def test_a_bus_is_named_by_a_file(tmp_path: Path) -> None:
    (tmp_path / "canrc").write_text("[default]\ninterface = virtual\nchannel = x\n")
    assert opened() == ("virtual x", "x")


def test_the_driver_gets_what_is_meant_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}

    def take(**keywords: Any) -> can.BusABC:
        given.update(keywords)
        raise can.CanInitializationError("no adapter")

    monkeypatch.setattr("can.Bus", take)
    timing = ("f_clock=8000000", "brp=1", "tseg1=5", "tseg2=2", "sjw=1")
    words = ("app-name=x", "port=0x10", "rate=1.5")
    said = failed(
        interface="virtual", channel="c", bitrate=500_000, timing=timing, bus_kwargs=words
    )
    assert said == "CAN bus virtual c: no adapter"
    assert given.pop("timing") == can.BitTiming(8_000_000, 1, 5, 2, 1)
    assert given == {
        **{"single_handle": True, "interface": "virtual", "channel": "c", "bitrate": 500_000},
        **{"app_name": "x", "port": 16, "rate": 1.5},
    }


@pytest.mark.parametrize("option", GREEDY)
@pytest.mark.parametrize(
    ("words", "taken", "left"),
    [
        (["a=1", "b=2", "-q"], ("a=1", "b=2"), ()),
        (["a=1", "b=2", "can0", "c=3"], ("a=1", "b=2"), ("can0", "c=3")),
        (["a=1", "can0"], ("a=1",), ("can0",)),
        (["a=1", "-q", "can0"], ("a=1",), ("can0",)),
        (["a=1", "--", "b=2"], ("a=1",), ("b=2",)),
        (["no value", "a=1"], ("no value", "a=1"), ()),
    ],
)
def test_greedy_options_leave_words_that_are_no_values(
    option: str, words: list[str], taken: tuple[str, ...], left: tuple[str, ...]
) -> None:
    found: dict[str, Any] = {}

    @click.command(cls=BusCommand)
    @click.argument("source", nargs=-1)
    @click.option("-q", is_flag=True)
    @bus_options
    def command(**options: Any) -> None:
        found.update(options)

    CliRunner().invoke(command, [option, *words], catch_exceptions=False, standalone_mode=False)
    assert (found[option[2:].replace("-", "_")], found["source"]) == (taken, left)


def test_without_a_name_it_says_what_to_do() -> None:
    said = refused()
    assert said.startswith("no CAN bus is given: give -i INTERFACE -c CHANNEL, set CAN_INTERFACE")
    assert "slcan, socketcan," in said
    assert "; or give --scenario FILE, which runs in virtual time. python-can has" in said
    assert "\n" not in said


def test_a_tool_that_plays_no_scenario_names_none() -> None:
    with pytest.raises(Refused) as caught:
        open_raw(BusOptions())
    assert "write them into ~/.canrc. python-can has" in caught.value.message


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"bus_kwargs": ("a",)}, "--bus-kwargs 'a' is not KEY=VALUE"),
        ({"timing": ("brp=x",)}, "--timing 'brp=x' is not KEY=VALUE"),
        ({"timing": ("brp=1",)}, "--timing: "),
    ],
)
def test_options_that_are_none_are_one_line(options: dict[str, Any], error: str) -> None:
    said = refused(**options)
    assert said.startswith(error)
    assert "\n" not in said


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"interface": "slcan", "channel": "/nowhere"}, "CAN bus slcan /nowhere: [Errno 2] could"),
        ({"interface": "kvaser", "channel": "x"}, "CAN bus kvaser x: "),
    ],
)
def test_what_cannot_be_opened_is_one_line(options: dict[str, Any], error: str) -> None:
    said = failed(**options)
    assert said.startswith(error)
    assert "\n" not in said


@pytest.mark.parametrize(
    ("number", "hint"),
    [
        (97, "(this kernel has no SocketCAN; udp_multicast needs none)"),
        (19, "'ip link add dev NAME up type vcan')"),
    ],
)
def test_what_linux_lacks_is_explained(
    number: int, hint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(**keywords: Any) -> can.BusABC:
        raise OSError(number, "because")

    monkeypatch.setattr("can.Bus", fail)
    assert failed(interface="socketcan", channel="can0").endswith(hint)


def test_what_python_can_lacks_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**keywords: Any) -> can.BusABC:
        raise can.CanInterfaceNotImplementedError("msgpack not installed")

    monkeypatch.setattr("can.Bus", fail)
    said = failed(interface="udp_multicast", channel="239.74.163.2")
    assert said.endswith("(pip install 'python-can[multicast]')")


def test_a_wrong_configuration_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CAN_INTERFACE", "smoke")
    assert refused() == 'CAN bus: Unknown interface type "smoke"'
    monkeypatch.setenv("CAN_CONFIG", "{")
    assert refused().startswith("CAN bus: ")
