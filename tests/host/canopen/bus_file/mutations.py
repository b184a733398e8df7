"""Bus files with chance in them: characters, lines, keys, values, blocks, cut off, binary."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Final

from tests.host.canopen.bus_file.bench import NODE, ROOT, concise_dcf
from tests.host.canopen.bus_file.shapes import GOOD
from tests.mutators import damaged, with_line, with_piece
from tickrig.host.canopen.bus_file.bus_file import BusFile, decode_bus_file, is_bus_file
from tickrig.host.canopen.data_sheet.rule import RuleFinding

NAME: Final = str(ROOT / "examples/eds/mutated.yml")
"""Where the files would be: beside EDS files."""
OTHER: Final = "../io_module.eds"
THIRD: Final = "../../tests/host/canopen/bus_file/lamp.eds"
SEEDS: Final = (
    *(text.replace("io.eds", OTHER).replace("lamp.eds", THIRD) for text in GOOD.values()),
    NODE + "  tickrig: {motor: {inertia: 1e-4}}\n  num_channels: 2\n  channel_names: [a, b]\n",
    NODE.replace("epos.eds", OTHER) + "  tpdo: {1: {cob_id: 0x181, mapping: [{index: 0x6000}]}}\n",
)
PIECES: Final = (
    *("[", "]", "{", "}", ":", ": ", ",", "- ", "'", '"', "\n", "\n\n", "#", "&a ", "*a", "<<: *a"),
    *("!!int ", "!!python/object:os.system ", "!", "%", "@", "`", "|", ">", "?", "\t", "  ", "\r"),
    *("\x00", "\ufeff", "\u2028", "é", "\ud800", "---\n", "...\n", "\\", "~", "-", "."),
)
VALUES: Final = (
    *(
        "",
        "0",
        "1",
        "-1",
        "2",
        "5",
        "127",
        "128",
        "255",
        "0x80",
        "0x180",
        "0x182",
        "0x600",
        "0x680",
    ),
    *(
        "0x80000182",
        "0xFFFFFFFF",
        "0x100000000",
        "-3",
        "3.5",
        "1e9",
        ".inf",
        ".nan",
        "-.inf",
        "1e999",
    ),
    *("010", "0o7", "1_000", "12:30:45", "2020-13-45", "2020-01-01", "9" * 400, "0x" + "F" * 4_000),
    *(
        "true",
        "false",
        "yes",
        "no",
        "null",
        "~",
        "auto",
        '"auto"',
        "'0x10'",
        "'5'",
        "abc",
        "é",
        "''",
    ),
    *("[]", "{}", "[1, 2]", "{a: 1}", "[[[]]]", "{1: {}}", "&a [*a]", "&b {c: *b}", "*nowhere"),
    *("!!python/name:os.system", "!!binary YWJj", "!!int ''", "!!float x", "!!timestamp x", "!x y"),
    *("epos.eds", OTHER, "nowhere.eds", ".", "/dev/zero", "/", '"a\\0b"', "$HOME", "EPOS.EDS"),
    *("'@BUS_CONFIG_PATH@'", "x" * 5_000, "[" * 600 + "]" * 600, "{a: " * 400 + "}" * 400),
    *("0x6040", "0x6041", "0x6064", "0x1018", "0x1A00", "0x1800", "0xFFFF", "0x10000", '"\\uD800"'),
)
KEYS: Final = (
    *("node_id", "dcf", "dcf_path", "driver", "package", "sdo", "tpdo", "rpdo", "mapping", "index"),
    *("sub_index", "value", "enabled", "cob_id", "transmission", "inhibit_time", "event_timer"),
    *("event_deadline", "sync_start", "heartbeat_producer", "heartbeat_consumer", "guard_time"),
    *("life_time_factor", "time_cob_id", "error_behavior", "revision_number", "serial_number"),
    *("software_version", "restore_configuration", "configuration_file", "boot", "mandatory"),
    *("master", "options", "defaults", "nodes", ".hidden", "tickrig", "channels", "num_channels"),
    *("channel_names", "scale_pos_to_dev", "retry_factor", "heartbeat_multiplier", "sync_period"),
    *(
        "vendor_id",
        "bits",
        "node-id",
        "nodeid",
        "",
        "1",
        "2",
        "5",
        "true",
        "null",
        "1.5",
        "<<",
        "? x",
    ),
)
_PAIR: Final = re.compile(r"([\w.\"']+): *([^,{}\[\]\n]*)")
Change = Callable[[str, Random], str]


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return a bus.yml with a few things done to it, and its name."""
    return NAME, _bytes(_text(chance), chance)


def _text(chance: Random) -> str:
    text = chance.choice(SEEDS)
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8])):
        text = chance.choice(CHANGES)(text, chance)
    return text


def _bytes(text: str, chance: Random) -> bytes:
    data = text.encode("utf-8", "surrogatepass" if chance.random() < 0.5 else "replace")
    how = chance.randrange(24)
    match how:
        case 2:
            return data.replace(b"\n", b"\r\n")
        case 3:
            return text.encode("utf-16", "replace")
    return damaged(data, chance, how)


def _indent(text: str, chance: Random) -> str:
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    lines[at] = chance.choice(["  " + lines[at], lines[at][2:], lines[at].strip()])
    return "\n".join(lines)


def _value(text: str, chance: Random) -> str:
    found = list(_PAIR.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    new = chance.choice([chance.choice(VALUES), other[2]])
    return text[: one.start(2)] + new + text[one.end(2) :]


def _key(text: str, chance: Random) -> str:
    found = list(_PAIR.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    name = one[1]
    at = chance.randrange(len(name))
    new = chance.choice([other[1], chance.choice(KEYS), name[:at] + name[at + 1 :], f"{name}s"])
    return text[: one.start(1)] + new + text[one.end(1) :]


def _added(text: str, chance: Random) -> str:
    lines = text.split("\n")
    at = chance.randrange(len(lines))
    indent = re.match(" *", lines[at])
    pair = f"{chance.choice(KEYS)}: {chance.choice(VALUES)}"
    lines.insert(at, f"{indent[0] if indent else ''}{pair}")
    return "\n".join(lines)


def _block(text: str, chance: Random) -> str:
    """Tear the text at two lines, and put its parts together in another order."""
    lines = text.split("\n")
    first, second = sorted(chance.randrange(len(lines) + 1) for _ in range(2))
    a, b, c = lines[:first], lines[first:second], lines[second:]
    return "\n".join(chance.choice([a + c + b, a + b + b + c, a + c, b + a + c]))


CHANGES: Final[tuple[Change, ...]] = (
    *(partial(with_piece, PIECES), with_line, _indent, _block),
    *(_value, _value, _value, _key, _key, _added, _added),
)


def judge(name: str, data: bytes) -> str:
    """Read a file; AssertionError unless it is told well what is wrong with it.

    Args:
        name: where it would be.
        data: the file.

    Returns:
        `good`, `warned` or `wrong`.
    """
    path = Path(NAME).parent / name  # a relative name is that of a kept file
    is_bus_file(data)
    bus = decode_bus_file(data, path)
    lines = data.count(b"\n") + data.count(b"\r") + data.count("\u2028".encode()) + 1
    for one in bus.findings:
        _check(one, path, lines)
    assert decode_bus_file(data, path).findings == bus.findings
    _use(bus)
    return "wrong" if bus.errors else "warned" if bus.warnings else "good"


def _check(one: RuleFinding, path: Path, lines: int) -> None:
    assert str(one).isprintable(), one
    assert len(str(one)) < 1_000, one
    assert one.file != str(path) or 0 <= one.line <= lines, one


def _use(bus: BusFile) -> None:
    """Do what emulator and master do with it."""
    for slave in bus.slaves.values():
        assert 1 <= slave.node_id <= 127
        assert len(concise_dcf(slave.writes)) >= 4
        assert all(0 <= write.index <= 0xFFFF and write.sub_index <= 0xFF for write in slave.writes)
        assert len(slave.channel_names) == slave.num_channels
        hash(slave.pdos)
