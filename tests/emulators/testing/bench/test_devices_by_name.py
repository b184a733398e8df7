"""What a rig file has as `type` can be put on a bench by a program too."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from serial import SerialException, serial_for_url

from tests.wire.canopen.eds.xdd_text import XDD
from tickrig import Bench, open_bench
from tickrig.device import make_epos

EXAMPLES = Path(__file__).parents[4] / "examples"


@pytest.mark.parametrize("name", ["epos", "f-palette", "motor-core-unit", "rtc-echo"])
def test_a_canopen_model_by_its_name(name: str) -> None:
    with Bench(name) as bench:
        assert bench.devices == (name.replace("-", "_"),)
        network = bench.canopen_network()
        bench.run_for("100ms")
        assert bench.get("state") == "Pre-operational"
        network.disconnect()


def test_a_model_by_its_name_is_recorded_as_such(tmp_path: Path) -> None:
    for device in ("epos", make_epos()):
        with Bench(epos=device) as bench:
            bench.run_for("10ms")
            bench.save_trace(tmp_path / f"{type(device).__name__}.trace")
    first, second = sorted(tmp_path.iterdir())
    assert first.read_bytes() == second.read_bytes()


def test_a_device_rtc_of_a_file() -> None:
    with Bench(f"9={EXAMPLES / 'device_rtc_gripper.py'}:Gripper") as bench:
        assert bench.devices == ("Gripper",)


def test_an_eds_with_its_node_id() -> None:
    with Bench(f"2={EXAMPLES / 'eds' / 'epos.eds'}", other="epos") as bench:
        assert bench.devices == ("epos", "other")
        bench.run_for("100ms")
        assert "702#00" in bench.transcript()


@pytest.mark.parametrize(
    ("device", "text"),
    [
        ("EPOS", "no device 'EPOS'; did you mean 'epos'?"),
        ("RRC", "no device 'RRC'; did you mean 'rrc'?"),
        ("fpalette", "no device 'fpalette'; did you mean 'f-palette'?"),
        ("toaster", "no device 'toaster'; known: rrc, "),
        ("rig.toml", "rig.toml is a rig file: open_bench('rig.toml') opens its bench"),
        ("a/bus.yml", "a/bus.yml is a rig file: open_bench('a/bus.yml') opens its bench"),
        ("128=epos", "it takes 1..127, or lss for a node that waits for LSS, not 128"),
        ("5=rrc", "5=rrc: rrc is on no CAN bus, and has no node-ID"),
        ("missing.eds", "missing.eds: No such file or directory"),
        (f"{EXAMPLES / 'eds' / 'epos.eds'}", "epos.eds gives no node-ID: write '5="),
    ],
)
def test_what_is_no_device_is_told_in_a_line(device: str, text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)) as caught:
        Bench(device)
    assert "\n" not in str(caught.value)


def test_two_of_a_model_share_its_node_id() -> None:
    with pytest.raises(
        ValueError, match="right: node-ID 1 is that of 'left' already: write '2=\\.\\.\\.'"
    ):
        Bench(left="epos", right="epos")


def test_the_name_of_a_device_is_no_rig_file() -> None:
    with pytest.raises(FileNotFoundError, match=r"it is the name of a device: .*Bench\('epos'\)"):
        open_bench("epos")
    with pytest.raises(FileNotFoundError, match=r"it is a node of a bus.yml: Bench\('b.yml:one'\)"):
        open_bench("b.yml:one")
    with pytest.raises(FileNotFoundError):
        open_bench("eposs")


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda bench: bench.set("stik", 1), "no input 'stik'; did you mean 'stick'?"),
        (lambda bench: bench.get("stete"), "input or output \"stete\"; did you mean 'state'?"),
        (
            lambda bench: bench.press("power_buton"),
            "no button 'power_buton'; did you mean 'power_button'?",
        ),
        (lambda bench: bench.press("stick"), "no button 'stick'; known: power_button"),
        (lambda bench: bench.fault("cutt"), "no fault 'cutt'; did you mean 'cut'?"),
        (lambda bench: bench.clear("CUT"), "no fault 'CUT'; did you mean 'cut'?"),
        (lambda bench: bench.fault("cutt=x@2s-1s"), "no fault 'cutt'; did you mean 'cut'?"),
        (lambda bench: bench.fault("cutt", for_="soon"), "no fault 'cutt'; did you mean 'cut'?"),
        (lambda bench: bench.fault("cutt@2s", when=bool), "no fault 'cutt'; did you mean 'cut'?"),
        (
            lambda bench: bench.fault("chair=cut"),
            "'cut' is not a rate; the fault cut of chair is chair/cut",
        ),
        (lambda bench: bench["rcr"], "no device 'rcr'; did you mean 'rrc'?"),
    ],
)
def test_a_misspelt_name_is_guessed(act: object, text: str) -> None:
    with Bench("rrc") as bench, pytest.raises((ValueError, KeyError)) as caught:
        act(bench)  # type: ignore[operator]
    assert text in str(caught.value)


def test_a_misspelt_name_is_guessed_among_several_devices() -> None:
    with Bench(left="rrc", right="epos") as bench:
        for act, text in (
            (lambda: bench.set("left/stik", 1, 2), "did you mean 'left/stick'?"),
            (lambda: bench["left"].press("power_buton"), "did you mean 'left/power_button'?"),
            (lambda: bench.press("power_button"), "did you mean 'left/power_button'?"),
            (lambda: bench["right"].get("stete"), "did you mean 'right/state'?"),
            (lambda: bench["right"].fault("unpluged"), "of right; did you mean 'unplugged'?"),
        ):
            with pytest.raises(ValueError, match=re.escape(text)):
                act()


def test_a_port_has_the_name_that_the_bench_gave_it() -> None:
    with Bench(chair="rrc") as bench:
        port = bench.serial()
        assert port.port == "chair"
        with pytest.raises(SerialException, match="could not open port chair: another host has"):
            bench.serial()
        port.close()
        with pytest.raises(SerialException, match=r"tickrig://chiar: .*did you mean .*chair'\?"):
            serial_for_url(bench.url.replace("chair", "chiar"))


def test_an_xdd_names_a_device_as_an_eds_does(tmp_path: Path) -> None:
    xdd = tmp_path / "lamp.xdd"
    xdd.write_text(XDD, "utf-8")
    with Bench(f"5={xdd}") as bench:
        bench.run_for("11ms")
