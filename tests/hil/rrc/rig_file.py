"""The file that says where the real hardware is (README.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

MAX_STICK_PCT: Final = 50
MAX_TIME_MS: Final = 1_000


class BadRigFile(ValueError):  # noqa: N818 - what it is
    """The rig file cannot be used; the text is for whoever wrote it."""


@dataclass(frozen=True, slots=True)
class RigFile:
    """What a rig file says.

    Attributes:
        port: device path or pyserial URL of the RRC.
        stick_pct: how far a stick held by hand may be off.
        time_us: how far a time may be off.
        control: control socket of an emulator that stands in for the operator.
    """

    port: str
    stick_pct: int = 10
    time_us: int = 50_000
    control: Path | None = None


RIG: Final = pytest.StashKey[RigFile]()


def read_rig_file(path: str) -> RigFile:
    """Read and check a rig file; BadRigFile says what is wrong with it."""
    try:
        content = tomllib.loads(Path(path).read_text("utf-8"))
    except OSError as error:
        raise BadRigFile(f"{path}: {error.strerror}") from None
    except ValueError as error:  # TOML and UTF-8
        raise BadRigFile(f"{path}: {error}") from None
    try:
        return _read(content)
    except BadRigFile as error:
        raise BadRigFile(f"{path}: {error}") from None


def _read(content: Mapping[str, object]) -> RigFile:
    _check_keys(content, "the file", ("dut", "tolerance", "operator"))
    dut = _table(content, "dut", ("rrc",))
    rrc = _table(dut, "rrc", ("port",), "dut.rrc")
    tolerance = _table(content, "tolerance", ("stick_pct", "time_ms"))
    operator = _table(content, "operator", ("control",))
    if "port" not in rrc:
        raise BadRigFile('[dut.rrc] needs a port, as port = "/dev/ttyACM0"')
    control = _text(operator, "control", "operator") if operator else None
    return RigFile(
        port=_text(rrc, "port", "dut.rrc"),
        stick_pct=_number(tolerance, "stick_pct", 10, MAX_STICK_PCT),
        time_us=_number(tolerance, "time_ms", 50, MAX_TIME_MS) * 1_000,
        control=Path(control) if control else None,
    )


def _check_keys(table: Mapping[str, object], where: str, known: tuple[str, ...]) -> None:
    if unknown := [key for key in table if key not in known]:
        raise BadRigFile(f"{where} has no {unknown[0]!r}; known: {', '.join(known)}")


def _table(
    parent: Mapping[str, object], key: str, known: tuple[str, ...], where: str = ""
) -> Mapping[str, object]:
    where = f"[{where or key}]"
    table = parent.get(key, {})
    if not isinstance(table, dict):
        raise BadRigFile(f"{where} is not a table")
    _check_keys(table, where, known)
    return table


def _text(table: Mapping[str, object], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value:
        raise BadRigFile(f"[{where}] {key} is {value!r}, a text is needed")
    return value


def _number(table: Mapping[str, object], key: str, default: int, high: int) -> int:
    value = table.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= high:
        raise BadRigFile(f"[tolerance] {key} is {value!r}, a whole number 0..{high} is needed")
    return value
