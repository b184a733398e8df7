"""Devices of a bench in the header of a trace, and devices rebuilt from the header."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO, PROFILES, is_bus_node
from tickrig.emulators.commands.device_type import build_recorded, check_no_code
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry
from tickrig.host.text.trace import Header
from tickrig.host.text.user_file import SUFFIX

if TYPE_CHECKING:
    from tickrig.device.canopen.dictionary import Dictionary
    from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile

_PROFILE: Final = "profile"
_SDO_TIMEOUT: Final = "sdo_timeout_us"
_SDO_MEMORY: Final = "sdo_memory_bytes"


def node_entry(
    wire: str,
    slave: CanopenSlave,
    device: Path | str = "",
    profile: str = AUTO,
    files: Iterable[Path] = (),
) -> DeviceEntry:
    """Return the description of a CANopen slave for the header of a trace.

    A replay makes the slave from this description. Call this function before the first tick of the
    slave.

    Args:
        wire: name of the bus.
        slave: the slave.
        device: source of the device: EDS or DCF, name of a model, or `FILE.py:Class`. If it is
            empty, the source is the model name of the slave.
        profile: CiA profile by which a device from an EDS or DCF file is emulated: one of
            `choices.PROFILES`.
        files: further source files.

    Raises:
        OSError: a file cannot be read.
    """
    file = _file_of(str(device)) if isinstance(device, str) else device
    servers, usual = late.SdoServers, late.USUAL
    sdo = next((x.limits for x in slave.services if isinstance(x, servers)), usual)
    config: dict[str, str | int] = {_PROFILE: profile} if isinstance(device, Path) else {}
    if sdo != usual:
        config |= {_SDO_TIMEOUT: sdo.timeout_us, _SDO_MEMORY: sdo.memory_bytes}
    memory = slave.nonvolatile
    stored = memory.parameters or memory.node_id or memory.bit_rate_index is not None
    return DeviceEntry(
        wire,
        str(device) or slave.model,
        config,
        slave.configured_id,
        _hash(file) if file else "",
        {each.name: _hash(each) for each in files},
        late.memory_values(memory) if stored else {},
    )


def make_recorded(
    header: BenchHeader, name: str, folder: Path, cache: late.EdsCache, *, run_code: bool = False
) -> Any:
    """Make a device for a replay, in the state that it had when the recording began.

    Args:
        header: header of the trace.
        name: name of the device in the header.
        folder: folder of the trace. Files that the trace names are searched in this folder.
        cache: cache of EDS files.
        run_code: whether a Python file that the trace names may be run.

    Raises:
        ValueError: the device cannot be made.
    """
    entry, on_can = header.devices[name], header.on_can(name)
    try:
        if not entry.type:
            raise ValueError("it was made by a program, not of a type")
        check_no_code(user_code([entry]), run_code=run_code)
        if on_can is (entry.node_id is None):
            raise ValueError(f"{entry.type} cannot be on wire {entry.wire}")
        if entry.node_id is None:
            return build_recorded(Header(entry.type, entry.config), run_code=run_code)
        return _node(name, entry, folder, cache)
    except ValueError as error:
        raise ValueError(f"device {name}: {error}") from None


def user_code(entries: Iterable[DeviceEntry]) -> list[object]:
    """Return the texts in a trace's header that may name Python code of a user, `FILE.py:Class`.

    A replay checks them before it runs such code.
    """
    return [spec for entry in entries for spec in (entry.type, *entry.config.values())]


def _node(name: str, entry: DeviceEntry, folder: Path, cache: late.EdsCache) -> late.Node:
    device = _found(entry, folder)
    profile = str(entry.config.get(_PROFILE, AUTO))
    if profile not in PROFILES:
        raise ValueError(f"profile {profile!r:.60} is not one of {', '.join(PROFILES)}")
    description = late.describe(cache, device, profile)
    for file in description.files if entry.files else ():
        _check_same(file, entry.files.get(file.name))
    dictionary = description.make_dictionary()
    memory = _memory(entry, dictionary) if entry.stored else None
    usual = late.USUAL
    sdo = late.SdoLimits(
        int(entry.config.get(_SDO_TIMEOUT) or usual.timeout_us),
        int(entry.config.get(_SDO_MEMORY, usual.memory_bytes) or 0),
    )
    slave = late.make_slave(dictionary, entry.node_id or 0, memory, description.application, sdo)
    return late.Node(name, slave, late.CanWire())


def _memory(entry: DeviceEntry, dictionary: Dictionary) -> Nonvolatile:
    try:
        memory = late.parse_memory(entry.stored)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"what it had stored is damaged: {error!r}") from None
    if misfits := late.drop_misfits(memory, dictionary):
        raise ValueError(f"it has no room for what it had stored at {misfits[0]}")
    return memory


def _found(entry: DeviceEntry, folder: Path) -> Path | str:
    """Return the model, or the path of the recorded file."""
    if entry.type in late.MODELS:
        return entry.type
    named = _file_of(entry.type) or Path(entry.type)
    for file in (named, folder / named, folder / named.name):
        if file.is_file():
            _check_same(file, entry.sha256)
            return file if named == Path(entry.type) else f"{file}:{entry.type.rpartition(':')[2]}"
    raise ValueError(f"its file {named} is not here, nor beside the trace")


def _hash(file: Path) -> str:
    from hashlib import sha256  # noqa: PLC0415 - slow

    return sha256(file.read_bytes()).hexdigest()


def _check_same(file: Path, recorded: object) -> None:
    """Raise ValueError unless a file has the recorded hash."""
    if _hash(file) != recorded:
        raise ValueError(f"{file} is another file than the one that was recorded")


def _file_of(device: str) -> Path | None:
    """Return the file of `FILE.py:Class` or `FILE.yml:NODE`, or None for a model."""
    file, _, _ = device.rpartition(":")
    return Path(file) if file.endswith(SUFFIX) or is_bus_node(device) else None
