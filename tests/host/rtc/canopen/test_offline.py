"""What a System Definition has wrong, told without a bus."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.canopen.bench import EDS, PALETTE_AND_MOTOR, SYSTEMS, Bench
from tests.host.rtc.canopen.components import add_logger
from tickrig.host.rtc.canopen.commands.server import main
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.offline import boot_offline, check_offline
from tickrig.host.rtc.canopen.serve import open_server, read_files
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.wire.rtc_types.rtc import TimedOctet

KNOWN = "known: tpdo1, tpdo2, tpdo3, rpdo1"


def found(text: str, folder: Path = EDS) -> tuple[str, ...]:
    definition = parse_definition(PALETTE_AND_MOTOR + text)
    return check_offline(RtcCanopenServer(definition, read_files(definition, folder)))


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        (
            "rt_connections: [{from: Palette0.ai, to: Logger0.in}]",
            (f"rt_connections: Palette0 has no port 'ai'; {KNOWN}",),
        ),
        (
            "rt_connections: [{from: Logger0.out, to: Motor0.rpdo1}]",
            ("rt_connections: Motor0 has no port 'rpdo1'; known: tpdo2, rpdo2",),
        ),
        (
            "rt_connections: [{from: Palette0.tpdo1, to: Motor0.rpdo2}]",
            (
                "rt_connections: Palette0.tpdo1 carries IDL:RTC/TimedOctet:1.0,"
                " Motor0.rpdo2 IDL:RTC/TimedShortSeq:1.0",
            ),
        ),
        ("rt_connections: [{from: Palette0.tpdo1, to: Logger0.in}]", ()),
        (
            "pdo_links: [{from: 16.tpdo2, to: 32.rpdo1}]",
            ("pdo_links: 32.rpdo1 is off, or not there",),
        ),
        (
            "pdo_links: [{from: 16.tpdo1, to: 32.rpdo2}]",
            ("pdo_links: 16.tpdo1 has 8 bits, 32.rpdo2 has 64",),
        ),
        ("pdo_links: [{from: 16.tpdo2, to: 32.rpdo2}]", ()),
    ],
)
def test_what_will_be_refused_is_told_on_paper(text: str, mistakes: tuple[str, ...]) -> None:
    assert found(text) == mistakes


def test_a_pdo_that_the_definition_puts_on_is_on() -> None:
    definition = PALETTE_AND_MOTOR.replace(
        "unit.eds,", "unit.eds, pdos: {rpdo1: {mapping: [0x64110110]}},"
    )
    checked = parse_definition(definition + "pdo_links: [{from: 16.tpdo1, to: 32.rpdo1}]")
    server = RtcCanopenServer(checked, read_files(checked, EDS))
    assert check_offline(server) == ("pdo_links: 16.tpdo1 has 8 bits, 32.rpdo1 has 16",)


def test_two_pdos_that_are_sent_with_one_cob_id_are_told() -> None:
    definition = PALETTE_AND_MOTOR.replace(
        "unit.eds,", "unit.eds, pdos: {tpdo2: {cob_id: 0x290}, rpdo2: {cob_id: 0x190}},"
    )
    checked = parse_definition(definition)
    server = RtcCanopenServer(checked, read_files(checked, EDS))
    assert check_offline(server) == (
        "pdos: 16.tpdo2 and 32.tpdo2 are both sent as 290h; give each a cob_id of its own",
    )


@pytest.mark.parametrize("name", ["fig120", "beego", "fourx", "followers"])
def test_the_examples_have_no_mistake(name: str) -> None:
    assert check_offline(open_server(SYSTEMS / f"{name}.yaml")) == ()


def test_the_pdos_on_paper_are_those_of_the_device() -> None:
    bench = Bench()
    bench.boot()
    for node in bench.server.nodes.values():
        on = boot_offline(node.entry, node.file, node.writes)
        assert on is not None
        assert [(pdo.name, pdo.fields, pdo.bits) for pdo in on] == [
            (pdo.name, pdo.fields, pdo.bits) for pdo in node.layouts
        ]


def test_a_node_whose_eds_gives_no_values_is_not_judged(tmp_path: Path) -> None:
    for file in EDS.glob("*.eds"):
        lines = file.read_text("utf-8").splitlines(keepends=True)
        kept = (line for line in lines if not line.startswith("DefaultValue=0x6"))
        (tmp_path / file.name).write_text("".join(kept), "utf-8")
    assert found("rt_connections: [{from: Palette0.ai, to: Motor0.x}]", tmp_path) == ()
    assert found("pdo_links: [{from: 16.tpdo2, to: 32.rpdo1}]", tmp_path) == ()


def test_the_command_tells_all_and_ends_with_2(tmp_path: Path) -> None:
    (tmp_path / "eds").symlink_to(EDS)
    text = (
        PALETTE_AND_MOTOR + "pdo_links: [{from: 16.tpdo1, to: 32.rpdo2}]\n"
        "rt_connections: [{from: Palette0.ai, to: Motor0.rpdo2}]\n"
    ).replace("eds: ", "eds: eds/")
    file = tmp_path / "robot.yaml"
    file.write_text(text, "utf-8")
    result = CliRunner().invoke(main, [str(file), "--check"])
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        f"Error: {file}: pdo_links: 16.tpdo1 has 8 bits, 32.rpdo2 has 64",
        f"{file}: rt_connections: Palette0 has no port 'ai'; {KNOWN}",
    ]


def test_a_port_that_is_not_there_is_told_of_once() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "rt_connections: [{from: Palette0.ai, to: Logger0.in}]\n")
    bench.boot()
    bench.run_ms(100)
    assert bench.events(ServerEventType.CONNECTION_REFUSED) == [
        f"ConnectionRefused 0 Palette0 has no port 'ai'; {KNOWN}"
    ]
    add_logger(bench.server.manager, TimedOctet)
    bench.run_ms(100)
    assert len(bench.events(ServerEventType.CONNECTION_REFUSED)) == 1
    assert [entry.source for entry in bench.server.connections.wanted] == ["Palette0.ai"]


def test_a_definition_is_drawn_with_its_links_dashed() -> None:
    result = CliRunner().invoke(main, [str(SYSTEMS / "fig120.yaml"), "--dot"])
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert any(line.startswith('  "Motor0" [label="{<angle> angle}|Motor0') for line in lines)
    assert lines[-2:] == ['  "Palette0":"ai" -> "Motor0":"angle" [style=dashed];', "}"]
