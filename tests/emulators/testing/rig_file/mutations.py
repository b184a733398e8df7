"""Rig files with chance in them: characters, lines, keys, values, tables, cut off, binary."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from random import Random

from tests.emulators.testing.rig_file.test_reader import WHOLE
from tests.mutators import damaged, with_piece
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.rig_file.plan import RigFileError
from tickrig.emulators.testing.rig_file.reader import decode_rig_file

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
PLACE = RIGS / "mutated.toml"
"""Where the files would be, for those that they name."""

SEEDS = [WHOLE, *(file.read_text("utf-8") for file in sorted(RIGS.glob("*.toml")))]
SEEDS.append(
    f'{WHOLE}[safe.vr2]\nout_v_pct = 0\nstate = "WaitPowerOn"\n[safe]\nleft.shaft_deg = 0\n'
)
SEEDS.append(
    '[device.rrc]\ntype = "rrc"\n[hardware]\ncontrol = "rrc.ctl"\n[hardware.rrc]\n'
    'port = "/dev/ttyACM0"\n[hardware.tolerance]\nstick_pct = 5\ntime_ms = 20\n'
)

PIECES = ["[", "]", "{", "}", "=", ",", '"', "'", '"""', "\n", "#", ".", "\\", "\x00", "\r", "é"]
PIECES += ["\u2028", "\ufeff", "-", "0", "9" * 400, " ", "\t", "[[node]]\n", "[device.b]\n"]

VALUES = ["0", "-1", "1e400", "nan", "-inf", "9" * 30, "1.5", "true", '""', '"x"', "[]", "{}"]
VALUES += ["[[]]", "[1, 2]", "{a = 1}", "1979-05-27", "07:32:00", '"lss"', '"../io_module.eds"']
VALUES += [
    '"epos"',
    '"rrc"',
    '"rh3-base"',
    '"nowhere.py:A"',
    '"a\\u0000b"',
    '"cut@2s-1s"',
    "'''x'''",
]
VALUES += [
    '"can0"',
    '"rfc2217://7000"',
    "{formula = 'left.load_nm'}",
    "{ramp = [0, 1], over = '1s'}",
]
VALUES += ["{table = 'morning.csv'}", "{lag = 'load', tau = '1s'}", "127", "[true, 'x', {}]"]

TABLES = [
    "wire",
    "wire.can0",
    "device",
    "device.left",
    "device.vr2.start",
    "signal",
    "fault",
    "safe",
]
TABLES += [
    "safe.vr2",
    "body",
    "real",
    "real.vr2",
    "hardware",
    "hardware.tolerance",
    "x",
    "device.x",
    "[node]",
]

_KEY_VALUE = re.compile(r"^([^=\[#\n]+)=(.*)$", re.MULTILINE)


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return a rig file with a few things done to it, and its name."""
    text = chance.choice(SEEDS)
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8])):
        text = chance.choice(CHANGES)(text, chance)
    data = text.encode("utf-8", "surrogatepass")
    how = chance.randrange(20)
    return PLACE.name, data.replace(b"\n", b"\r\n") if how == 2 else damaged(data, chance, how)


def _line(text: str, chance: Random) -> str:
    lines = text.split("\n")
    line = lines.pop(chance.randrange(len(lines)))
    if chance.random() < 0.6:
        for _ in range(chance.choice([1, 2])):
            lines.insert(chance.randrange(len(lines) + 1), line)
    return "\n".join(lines)


def _key(text: str, chance: Random) -> str:
    found = list(_KEY_VALUE.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    name = one[1].strip()
    at = chance.randrange(len(name) + 1)
    new = chance.choice(
        [other[1], name[:at] + name[at + 1 :], f"{name}s", f"x.{name}", f'"{name}"']
    )
    return text[: one.start(1)] + new + text[one.end(1) :]


def _value(text: str, chance: Random) -> str:
    found = list(_KEY_VALUE.finditer(text))
    if not found:
        return text
    one, other = chance.choice(found), chance.choice(found)
    new = chance.choice([chance.choice(VALUES), other[2]])
    return f"{text[: one.start(2)]} {new}{text[one.end(2) :]}"


def _table(text: str, chance: Random) -> str:
    lines = text.split("\n")
    headers = [at for at, line in enumerate(lines) if line.startswith("[")]
    if headers and chance.random() < 0.5:
        lines[chance.choice(headers)] = f"[{chance.choice(TABLES)}]"
    else:
        lines.insert(chance.randrange(len(lines) + 1), f"[{chance.choice(TABLES)}]")
    return "\n".join(lines)


CHANGES = (partial(with_piece, PIECES), _line, _key, _value, _table, _value)


def judge(name: str, data: bytes) -> str:
    """Read a file; AssertionError unless it opens as a bench, or is told to be wrong as it should.

    Args:
        name: of the file.
        data: what it holds.

    Returns:
        `ok` or `mistakes`.
    """
    try:
        plan = decode_rig_file(data, PLACE.with_name(name))
    except RigFileError as error:
        _check(error, data.count(b"\n") + 1)
        return "mistakes"
    with Bench.of_plan(plan, "virtual") as bench:
        bench.run_for("11ms")
    return "ok"


def _check(error: RigFileError, lines: int) -> None:
    assert error.mistakes
    assert list(error.mistakes) == sorted(set(error.mistakes))
    for line, reason in error.mistakes:
        assert 1 <= line <= lines, (line, reason)
        assert reason.strip(), line
    shown = str(error).split("\n")
    assert len(shown) == len(error.mistakes), shown
    assert all(each.isprintable() for each in shown), shown
    assert max(map(len, shown)) < 1_000, shown
