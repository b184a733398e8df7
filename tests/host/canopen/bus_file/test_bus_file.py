from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.host.canopen.bus_file.bench import (
    LAMP,
    NODE,
    Generated,
    Pdo,
    concise_dcf,
    entry_of,
    generate,
    write_bus,
)
from tests.host.canopen.bus_file.shapes import COGEN, GOOD, PLAIN
from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.bus_file.bus_values import BusPdo, BusSlave


@pytest.mark.parametrize("name", GOOD)
def test_the_writes_are_those_of_dcfgen(name: str, tmp_path: Path) -> None:
    path = write_bus(tmp_path, GOOD[name])
    theirs, ours = generate(path), read_bus_file(path)
    assert not ours.errors
    assert list(ours.slaves) == list(theirs.slaves)
    for slave, other in pairs(ours, theirs):
        assert [entry_of(write).hex() for write in slave.writes] == [one.hex() for one in other.sdo]


@pytest.mark.parametrize("name", GOOD)
def test_the_master_is_that_of_dcfgen(name: str, tmp_path: Path) -> None:
    path = write_bus(tmp_path, GOOD[name])
    theirs, ours = generate(path), read_bus_file(path)
    assert ours.master is not None
    for ours_name, their_name in (
        ("node_id", "node_id"),
        ("sync_period_us", "sync_period"),
        ("heartbeat_producer_ms", "heartbeat_producer"),
        ("heartbeat_multiplier", "heartbeat_multiplier"),
        ("start", "start"),
    ):
        assert getattr(ours.master, ours_name) == getattr(theirs.master, their_name)
    for slave, other in pairs(ours, theirs):
        assert [pdo_of(pdo) for pdo in slave.master_pdos] == pdos_of(other)
        identity = slave.identity
        assert (identity.device_type, identity.vendor_id) == (other.device_type, other.vendor_id)
        for sub, key in (
            (2, "product_code"),
            (3, "revision_number"),
            (4, "serial_number"),
        ):
            checked = getattr(other, key) if sub in other[0x1018] else 0
            assert getattr(identity, key) == checked
        for key, their_key in (
            *((key, key) for key in ("boot", "mandatory", "reset_communication", "emcy_cob_id")),
            *((key, key) for key in ("retry_factor", "heartbeat_multiplier", "software_version")),
            *((key, key) for key in ("heartbeat_consumer", "restore_configuration")),
            ("heartbeat_producer_ms", "heartbeat_producer"),
            ("guard_time_ms", "guard_time"),
            ("life_time_factor", "life_time_factor"),
        ):
            assert getattr(slave, key) == getattr(other, their_key), key


def test_after_the_writes_the_slave_has_the_pdos_of_the_file(tmp_path: Path) -> None:
    slave = read_bus_file(write_bus(tmp_path, PLAIN)).slaves["left"]
    rpdo, off, *_ = (pdo for pdo in slave.pdos if not pdo.transmit)
    assert (rpdo.cob_id, [entry.index for entry in rpdo.mapping]) == (0x205, [0x6040, 0x6060])
    assert off.cob_id == 0x8000_0302
    first, second, third, *_ = (pdo for pdo in slave.pdos if pdo.transmit)
    assert (first.cob_id, first.transmission, len(first.mapping)) == (0x182, 1, 2)
    assert (second.event_timer_ms, second.inhibit_time_100us) == (100, 5)
    assert not third.enabled


def test_defaults_count_more_than_what_a_node_says(tmp_path: Path) -> None:
    bus = read_bus_file(write_bus(tmp_path, COGEN))
    assert [slave.heartbeat_producer_ms for slave in bus.slaves.values()] == [200, 200]
    assert [one.rule.name for one in bus.warnings] == ["defaults-win"]
    assert bus.warnings[0].line == 21
    assert "bus.yml:9" in bus.warnings[0].text


@pytest.mark.parametrize(
    ("dcf", "dcf_path", "is_beside"),
    [
        ("sheets/drive.eds", "", True),
        ("$SHEETS/drive.eds", "", True),
        ("drive.eds", "sheets", False),
        ("drive.eds", "@BUS_CONFIG_PATH@/sheets", False),
        ("drive.eds", "${SHEETS}", False),
        ("/opt/robot/share/config/epos.eds", "", False),
        ("install/config/above.eds", "install", False),
    ],
)
def test_an_eds_is_found(
    dcf: str, dcf_path: str, is_beside: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "config"
    (folder / "sheets").mkdir(parents=True)
    monkeypatch.setenv("SHEETS", str(folder / "sheets"))
    options = f'options: {{dcf_path: "{dcf_path}"}}\n' if dcf_path else ""
    path = write_bus(folder, options + NODE.replace("epos.eds", dcf))
    (folder / "sheets" / "drive.eds").write_text(LAMP, "utf-8")
    (tmp_path / "above.eds").write_text(LAMP, "utf-8")
    bus = read_bus_file(path)
    assert bus.slaves["axis"].sheet.is_file()
    told = [one.rule.name for one in bus.findings]
    assert told == ([] if is_beside else ["file-elsewhere"])


def test_an_eds_of_no_name_that_is_there_says_where_it_was_looked_for(tmp_path: Path) -> None:
    path = write_bus(tmp_path, NODE.replace("epos.eds", "sheets/none.eds"))
    (error,) = read_bus_file(path).errors
    assert f"looked in {tmp_path / 'sheets'}, {tmp_path}, {tmp_path.parent}" in error.text


def test_a_folder_or_a_device_is_no_eds(tmp_path: Path) -> None:
    for name in (".", "/dev/zero", "sheets"):
        (tmp_path / "sheets").mkdir(exist_ok=True)
        bus = read_bus_file(write_bus(tmp_path, NODE.replace("epos.eds", name)))
        assert [one.rule.name for one in bus.findings] == ["no-file"]


def test_a_long_name_stays_whole(tmp_path: Path) -> None:
    name = "left_front_arm_of_the_second_robot_shoulder_pitch_joint"
    bus = read_bus_file(write_bus(tmp_path, NODE.replace("axis", name)))
    assert bus.slaves[name].name == name
    assert bus.slaves[name].channel_names == (name,)


def test_axes_have_names_and_scales_of_their_own(tmp_path: Path) -> None:
    keys = "num_channels: 3\n  channel_names: [a, b]\n  scale_pos_to_dev: 5\n"
    text = f"{NODE}  {keys}  channels: [{{}}, {{scale_pos_to_dev: 7}}]\n"
    slave = read_bus_file(write_bus(tmp_path, text)).slaves["axis"]
    assert slave.channel_names == ("a", "b", "axis/2")
    assert [channel.scale_pos_to_dev for channel in slave.channels] == [5, 7, 5]
    assert slave.num_channels == 3


def test_an_eds_that_counts_to_the_end_of_time_is_read_at_once(tmp_path: Path) -> None:
    path = write_bus(tmp_path, NODE.replace("epos", "lamp"))
    head, line, tail = LAMP.partition("[1A00sub0]\n")
    tail = tail.replace("DataType=0x0005", "DataType=0x001B", 1)
    tail = tail.replace("DefaultValue=0x01", "DefaultValue=0xFFFFFFFFFFFFFFFF", 1)
    (tmp_path / "lamp.eds").write_text(head + line + tail, "utf-8")
    pdo = next(pdo for pdo in read_bus_file(path).slaves["axis"].pdos if pdo.transmit)
    assert [entry.index for entry in pdo.mapping] == [0x2000, 0, 0, 0]


def test_what_is_hidden_may_be_anything(tmp_path: Path) -> None:
    text = f".pdo: &pdo [{{index: 0x6041}}]\n.five: &five 5\n{NODE}  heartbeat_producer: *five\n"
    bus = read_bus_file(write_bus(tmp_path, f"{text}  tpdo: {{1: {{mapping: *pdo}}}}\n"))
    assert bus.findings == ()
    assert bus.slaves["axis"].heartbeat_producer_ms == 5


def test_findings_of_one_line_come_in_its_order(tmp_path: Path) -> None:
    keys = ["vendor_id", "boot", "dcf", "mandatory", "sdo", "rpdo", "retry_factor"]
    defaults = ", ".join(f"{key}: {value}" for key, value in zip(keys, [0] * 7, strict=True))
    own = ", ".join(f"{key}: 1" for key in keys)
    text = f"master: {{node_id: 1}}\ndefaults: {{{defaults}}}\nnodes: {{a: {{{own}}}}}\n"
    bus = read_bus_file(write_bus(tmp_path, text))
    told = [one.text.split()[0] for one in bus.findings if one.rule.name == "defaults-win"]
    assert told == keys


@pytest.mark.parametrize(
    "entry",
    [
        "sdo: [{index: 0x1018, subindex: 1, value: 1}]",
        "sdo: [{index: 0x6060, valu: 3}]",
        "tpdo: {1: {mapping: [{index: 0x6098, subindex: 3}]}}",
    ],
)
def test_what_follows_from_a_key_that_nobody_knows_is_not_told(entry: str, tmp_path: Path) -> None:
    bus = read_bus_file(write_bus(tmp_path, f"{NODE}  {entry}\n"))
    assert [one.rule.name for one in bus.findings] == ["unknown-key"]


def test_what_is_for_us_is_handed_on_with_its_lines(tmp_path: Path) -> None:
    text = NODE + "  tickrig:\n    motor:\n      inertia_kg_m2: 1e-4\n"
    slave = read_bus_file(write_bus(tmp_path, text)).slaves["axis"]
    inertia = slave.extra["motor"].fields["inertia_kg_m2"]
    assert inertia.text == "1e-4"
    assert (inertia.place.line, slave.extra["motor"].keys["inertia_kg_m2"].line) == (7, 7)


def test_a_concise_dcf_begins_with_its_count(tmp_path: Path) -> None:
    text = NODE + "  sdo: [{index: 0x6060, value: -1}]\n"
    slave = read_bus_file(write_bus(tmp_path, text)).slaves["axis"]
    assert concise_dcf(slave.writes).hex() == "01000000" + "6060" + "00" + "01000000" + "ff"


def pairs(ours: BusFile, theirs: Generated) -> list[tuple[BusSlave, Any]]:
    return [(ours.slaves[name], theirs.slaves[name]) for name in theirs.slaves]


def pdo_of(pdo: BusPdo) -> Pdo:
    mapping = tuple((one.index, one.sub, one.bits) for one in pdo.mapping)
    return Pdo(pdo.number, pdo.transmit, pdo.cob_id, pdo.transmission, mapping)


def pdos_of(slave: Any) -> list[Pdo]:
    return [
        Pdo(
            *(number, transmit, pdo.cob_id, pdo.transmission_type),
            tuple((sub.index, sub.sub_index, sub.data_type.bits()) for sub in pdo.mapping.values()),
        )
        for transmit, pdos in ((True, slave.tpdo), (False, slave.rpdo))
        for number, pdo in pdos.items()
    ]


@pytest.mark.parametrize(("number", "expected"), [("0x00000000", 0), ("", 10), ("0x0000000A", 10)])
def test_a_vendor_number_of_0_is_not_checked(number: str, expected: int, tmp_path: Path) -> None:
    path = write_bus(tmp_path, NODE.replace("epos", "lamp"))
    sheet = path.with_name("lamp.eds")
    sheet.write_text(LAMP.replace("VendorNumber=0x0000000A", f"VendorNumber={number}"))
    (slave,) = read_bus_file(path).slaves.values()
    assert slave.identity.vendor_id == expected
