"""Checks of this machine for `tickrig doctor`: what tickrig can use.

Each check is a probe. It reads files, opens devices that any user may open, and closes them again.
No probe needs root. A probe that takes too long is abandoned. If a probe raises an exception, the
exception is the result of the check.
"""

from __future__ import annotations

import os
import platform
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from shutil import which
from threading import Thread
from typing import Final

import click

from tickrig._compiled import compiled
from tickrig._version import __version__
from tickrig.emulators.bench.running_emulator import keeping_time
from tickrig.emulators.rig.kernel import kernel
from tickrig.host.cli.messages import Refused
from tickrig.host.text.names import near
from tickrig.host.text.page_text import json_text, one_line


class _CheckState(StrEnum):
    """Result of a check.

    Attributes:
        OK: the checked item exists.
        NOTE: the checked item exists, and there is something to know about it.
        MISSING: the checked item does not exist.
    """

    OK = "ok"
    NOTE = "note"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class _CheckRow:
    """A row of the table.

    Attributes:
        name: name of the check, as `--need` accepts it.
        state: result of the check.
        found: description of the result as readable text.
        do: text that tells the user what to do, or empty if there is nothing to do.
        needed: whether tickrig does not work here without the item, or `--need` names it.
    """

    name: str
    state: _CheckState
    found: str
    do: str = ""
    needed: bool = False


_Rows = Iterator[_CheckRow]
_OK, _NOTE, _MISSING = _CheckState

# Python, tickrig and its packages.

_LEAST: Final = (3, 11)
_TESTED: Final = (3, 13)
_REQUIREMENT: Final = re.compile(r"([A-Za-z0-9._-]+)(?:\[[^]]*\])?([^;]*)(?:;(.*))?")
_AT_LEAST: Final = re.compile(r">=\s*([0-9.]+)")
_EXTRA: Final = re.compile(r"extra\s*==\s*['\"]([^'\"]+)['\"]")
_PLATFORM: Final = re.compile(r"sys_platform\s*==\s*['\"]([^'\"]+)['\"]")


def _python() -> _Rows:
    found = f"{platform.python_version()}, {sys.executable}"
    here = sys.version_info[:2]
    if here < _LEAST:
        yield _CheckRow("python", _MISSING, found, "install Python 3.11 or newer", needed=True)
    elif here > _TESTED:
        yield _CheckRow("python", _NOTE, found, "tested are 3.11, 3.12 and 3.13", needed=True)
    else:
        yield _CheckRow("python", _OK, found, needed=True)


def _build() -> _Rows:
    if compiled:
        yield _CheckRow("compiled", _OK, f"{__version__}, compiled")
    else:
        yield _CheckRow(
            "compiled",
            _NOTE,
            f"{__version__}, not compiled" + ", kernel in C" * kernel,
            "drives run 3 to 5 times as fast compiled: docs/howto/compiled.md",
        )


def _packages() -> _Rows:
    """Yield the packages that tickrig needs, and a row for each extra."""
    try:
        lines = requires("tickrig") or []
    except PackageNotFoundError:
        do = "pip install tickrig: its packages are checked then"
        yield _CheckRow("packages", _NOTE, "runs from a folder, not installed", do)
        return
    extras: dict[str, list[str]] = {"": []}
    for line in lines:
        requirement = _REQUIREMENT.match(line)
        if requirement is None:
            continue
        name, versions, marker = requirement[1], requirement[2], requirement[3] or ""
        elsewhere = _PLATFORM.search(marker)
        if elsewhere and elsewhere[1] != sys.platform:
            continue
        of_extra = _EXTRA.search(marker)
        extras.setdefault(of_extra[1] if of_extra else "", []).append(f"{name}{versions.strip()}")
    for extra, wanted in extras.items():
        if wanted:
            yield _package_row(extra, wanted)


def _package_row(extra: str, wanted: Sequence[str]) -> _CheckRow:
    """Return a row of packages that belong together."""
    name = f"extra {extra}" if extra else "packages"
    command = f"pip install 'tickrig[{extra}]'" if extra else "pip install --upgrade tickrig"
    found, lacking = [], []
    for text in wanted:
        package = re.split(r"[<>=!~\s]", text, maxsplit=1)[0]
        try:
            installed = version(package)
        except PackageNotFoundError:
            lacking.append(f"no {package}")
            continue
        least = _AT_LEAST.search(text)
        if least and _numbers(installed) < _numbers(least[1]):
            lacking.append(f"{package} {installed}, {least[1]} is needed")
        else:
            found.append(f"{package} {installed}")
    if lacking:
        return _CheckRow(name, _MISSING, "; ".join([*lacking, *found]), command, needed=not extra)
    return _CheckRow(name, _OK, ", ".join(found), needed=not extra)


def _numbers(text: str) -> tuple[int, ...]:
    """Return a version for comparisons; the text after the numbers does not count.

    >>> _numbers("8.2.0rc1") < _numbers("8.10")
    True
    """
    match = re.match(r"[0-9]+(?:\.[0-9]+)*", text)
    numbers = [int(one) for one in match[0].split(".")] if match else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


# What the system has.

_GROUPS: Final = ("dialout", "uucp")
"""Groups that may open serial ports, on Debian and Fedora, and on Arch."""
_NET: Final = Path("/sys/class/net")
_CAN: Final = "280"
"""The type of a CAN interface in `/sys/class/net` (ARPHRD_CAN)."""
_MODPROBE: Final = "sudo modprobe vcan; sudo ip link add vcan0 type vcan; sudo ip link set vcan0 up"
_NO_SOCKETCAN: Final = (
    'use interface = "udp_multicast", or tools/with-vcan of the source tree: docs/howto/ci.md'
)


def _terminals() -> _Rows:
    """Check for pseudo-terminals, where hosts reach emulators in real time."""
    if sys.platform == "win32":
        do = "emulators in real time run in WSL or a container: docs/howto/windows.md"
        yield _CheckRow("terminals", _NOTE, "Windows has no pseudo-terminals", do)
        return
    try:
        ends = os.openpty()
    except OSError as error:
        do = "mount devpts: emulators in real time are at pseudo-terminals"
        yield _CheckRow("terminals", _MISSING, error.strerror or str(error), do, needed=True)
        return
    path = os.ttyname(ends[1])
    for end in ends:
        os.close(end)
    yield _CheckRow("terminals", _OK, f"pseudo-terminals, as {path}", needed=True)


def _group() -> _Rows:
    if sys.platform == "win32":
        return
    import grp  # noqa: PLC0415 - POSIX

    for name in _GROUPS:
        try:
            number = grp.getgrnam(name).gr_gid
        except KeyError:
            continue
        if os.geteuid() == 0 or number in (os.getegid(), *os.getgroups()):
            is_root = "you are root" if os.geteuid() == 0 else "you are in it"
            yield _CheckRow(f"group {name}", _OK, is_root)
        else:
            do = f"sudo usermod -aG {name} $USER, then log in again"
            yield _CheckRow(f"group {name}", _MISSING, "it may open serial ports; you may not", do)
        return
    yield _CheckRow("group dialout", _NOTE, "there is no such group; look at `ls -l /dev/tty*`")


def _socketcan() -> _Rows:
    if sys.platform != "linux":
        yield _CheckRow(
            "socketcan", _MISSING, "it is part of Linux", 'use "udp_multicast", or slcan'
        )
        return
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        yield _CheckRow("socketcan", _MISSING, error.strerror or str(error), _NO_SOCKETCAN)
        return
    names = [path.name for path in sorted(_NET.glob("*")) if _read(path / "type") == _CAN]
    shown = [f"{name} ({'up' if _is_up(name) else 'down'})" for name in names]
    down = [name for name in names if not _is_up(name)]
    if down:
        do = f"sudo ip link set {down[0]} up type can bitrate 500000 (of a vcan: without type)"
        yield _CheckRow("socketcan", _NOTE, ", ".join(shown), do)
    else:
        yield _CheckRow("socketcan", _OK, ", ".join(shown) or "no interface yet")


def _is_up(name: str) -> bool:
    flags = _read(_NET / name / "flags")
    return bool(flags) and bool(int(flags, 16) & 1)


def _read(path: Path) -> str:
    with suppress(OSError):
        return path.read_text("ascii", "replace").strip()
    return ""


def _vcan() -> _Rows:
    if sys.platform != "linux":
        return
    modules = Path("/lib/modules") / platform.release()
    if Path("/sys/module/vcan").is_dir():
        yield _CheckRow("vcan", _OK, "the module is loaded")
    elif "/vcan.ko" in _read(modules / "modules.builtin"):
        yield _CheckRow("vcan", _OK, "built into the kernel")
    elif "/vcan.ko" in _read(modules / "modules.dep"):
        yield _CheckRow("vcan", _NOTE, "the module is there and not loaded", _MODPROBE)
    else:
        found = f"no module for {platform.release()}"
        yield _CheckRow("vcan", _MISSING, found, _NO_SOCKETCAN)


def _guests() -> _Rows:
    """Check for the virtual machine of `tools/with-vcan`, for a kernel without SocketCAN."""
    if sys.platform != "linux":
        return
    uml = which(os.environ.get("WITH_VCAN_UML", "linux.uml"))
    qemu = which(os.environ.get("WITH_VCAN_QEMU", "qemu-system-x86_64"))
    for name, path, packages in (
        ("uml", uml, "user-mode-linux kmod iproute2 mount"),
        ("qemu", qemu, "qemu-system-x86 linux-image-amd64 busybox-static kmod iproute2 mount"),
    ):
        if path is None:
            do = f"only for tools/with-vcan: sudo apt-get install {packages}"
            yield _CheckRow(name, _MISSING, "for SocketCAN in a guest", do)
        elif name == "qemu" and not os.access("/dev/kvm", os.R_OK | os.W_OK):
            do = "/dev/kvm cannot be opened: a guest is about 20 times slower"
            yield _CheckRow(name, _NOTE, path, do)
        else:
            yield _CheckRow(name, _OK, path)


# What is plugged in.


def _serial_ports() -> _Rows:
    from serial.tools.list_ports import comports  # noqa: PLC0415 - slow, and may hang

    ports = sorted(comports())
    for port in ports:
        about = f" [{port.vid:04x}:{port.pid:04x}]" if port.vid is not None else ""
        shown = "" if port.description in (None, "n/a") else f"{port.description}"
        found = f"{port.device} {shown}".rstrip() + about
        if sys.platform != "win32" and not os.access(port.device, os.R_OK | os.W_OK):
            do = "you may not open it: see the row of the group"
            yield _CheckRow("serial port", _MISSING, found, do)
        else:
            yield _CheckRow("serial port", _OK, found)
    if not ports:
        do = "plug an adapter in; emulators need none"
        yield _CheckRow("serial port", _NOTE, "none found", do)


_ADAPTERS: Final = """
import can, json, logging, os
logging.disable()
others = {"virtual", "udp_multicast", "tickrig", "socketcan", "slcan", "serial"}
found = can.detect_available_configs(sorted(set(can.VALID_INTERFACES) - others), 4)
print(json.dumps([[str(one["interface"]), str(one["channel"])] for one in found]), flush=True)
os._exit(0)
"""
"""Program of a separate process that lists adapters; it can be ended if a vendor's driver hangs."""

_ADAPTER_S: Final = 8.0


def _can_adapters() -> _Rows:
    import json  # noqa: PLC0415 - of this probe alone

    try:
        done = subprocess.run(
            [sys.executable, "-c", _ADAPTERS],
            capture_output=True,
            timeout=_ADAPTER_S,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        found = f"the drivers of python-can do not answer within {_ADAPTER_S:g} s"
        yield _CheckRow("can adapter", _NOTE, found)
        return
    last = done.stdout.decode("utf-8", "replace").strip().rpartition("\n")[2]
    adapters = json.loads(last or "[]")
    for interface, channel in adapters:
        yield _CheckRow("can adapter", _OK, f"{interface} {channel}")
    if not adapters:
        do = "adapters of SocketCAN and slcan are in the rows above; emulators need none"
        yield _CheckRow("can adapter", _NOTE, "none found by the drivers of python-can", do)


# How well this machine keeps time.

_WAITS: Final = 500
_WAIT_NS: Final = 1_000_000
_GOOD_US: Final = 1_000
_FAIR_US: Final = 10_000


def _jitter() -> _Rows:
    """Measure delays: wake up each millisecond for half a second, as a rig in real time does."""
    late_us = []
    with keeping_time():
        due_ns = time.perf_counter_ns()
        for _ in range(_WAITS):
            due_ns += _WAIT_NS
            time.sleep(max(0, due_ns - time.perf_counter_ns()) / 1e9)
            late_us.append(max(0, time.perf_counter_ns() - due_ns) // 1_000)
    late_us.sort()
    middle, most, worst = late_us[_WAITS // 2], late_us[_WAITS * 99 // 100], late_us[-1]
    found = f"of {_WAITS} wake-ups the median is {middle} us late, 99 % {most} us, worst {worst} us"
    if most <= _GOOD_US:
        yield _CheckRow("real time", _OK, found)
    elif most <= _FAIR_US:
        do = "CANopen nodes tick each 1 ms and are late at times; end other programs"
        yield _CheckRow("real time", _NOTE, found, do)
    else:
        do = "test in virtual time here; in real time, end other programs or take another machine"
        yield _CheckRow("real time", _NOTE, found, do)


# All of it.


@dataclass(frozen=True, slots=True)
class _Probe:
    """A check with its time-out, and with a name for a row if the check itself returns no row."""

    name: str
    look: Callable[[], _Rows]
    within_s: float = 3.0


_PROBES: Final = (
    _Probe("python", _python),
    _Probe("compiled", _build),
    _Probe("packages", _packages),
    _Probe("terminals", _terminals),
    _Probe("group", _group),
    _Probe("socketcan", _socketcan),
    _Probe("vcan", _vcan),
    _Probe("guests", _guests),
    _Probe("serial port", _serial_ports),
    _Probe("can adapter", _can_adapters, _ADAPTER_S + 1),
    _Probe("real time", _jitter),
)


def _rows_of(probe: _Probe) -> list[_CheckRow]:
    """Return the rows of a probe; if it fails or takes too long, a row has the reason."""
    rows: list[_CheckRow] = []

    def look() -> None:
        try:
            rows.extend(probe.look())
        except Exception as error:  # a probe of foreign drivers may raise anything
            why = f"{type(error).__name__}: {error}"
            rows.append(_CheckRow(probe.name, _NOTE, f"the check failed: {why}"))

    thread = Thread(target=look, daemon=True)
    thread.start()
    thread.join(probe.within_s)
    if thread.is_alive():
        return [_CheckRow(probe.name, _NOTE, f"no answer within {probe.within_s:g} s")]
    return rows


def run_doctor(*, as_json: bool, needs: Sequence[str]) -> int:
    """Check the installation, print a table of the checks, and return the exit status.

    The status is 1 if something needed is missing.

    Args:
        as_json: whether to print JSON in place of the table.
        needs: names of checks that must succeed, in addition to those that are always needed.

    Raises:
        Refused: a name in `needs` is not the name of a check.
    """
    rows = [row for probe in _PROBES for row in _rows_of(probe)]
    names = dict.fromkeys(row.name for row in rows)
    for need in needs:
        if need not in names and f"extra {need}" not in names:
            raise Refused(f"--need: no check {need!r}; {near(need, names)}")
    wanted = {*needs, *(f"extra {need}" for need in needs)}
    rows = [
        _CheckRow(row.name, row.state, row.found, row.do, row.needed or row.name in wanted)
        for row in rows
    ]
    lacking = list(dict.fromkeys(name for name in names if _lacks(rows, name, name in wanted)))
    if as_json:
        checks = [asdict(row) for row in rows]
        click.echo(json_text({"ok": not lacking, "missing": lacking, "checks": checks}))
        return bool(lacking)
    wide = max(len(row.name) for row in rows)
    for row in rows:
        click.echo(one_line(f"{row.state:7}  {row.name:{wide}}  {row.found}".rstrip()))
        if row.do:
            click.echo(one_line(f"{'':{wide + 11}}-> {row.do}"))
    told = (
        f"missing, and needed: {', '.join(lacking)}" if lacking else "all that is needed is there"
    )
    click.echo(f"\n{told}")
    return bool(lacking)


def _lacks(rows: Sequence[_CheckRow], name: str, is_wanted: bool) -> bool:
    """Return whether a needed item is missing; if there are several ports, one is enough."""
    states = [row.state for row in rows if row.name == name and row.needed]
    if is_wanted and name in ("serial port", "can adapter"):
        return _OK not in states
    return bool(states) and all(state is _MISSING for state in states)
