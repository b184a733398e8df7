"""The text of a new rig file: the devices with their defaults, and further options as comments."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import click

from tickrig.device.physical import InputSignal, SignalType
from tickrig.emulators.commands.device_type import option_names
from tickrig.emulators.testing.rig_file.devices import RESERVED, kind_of
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan
from tickrig.emulators.testing.rig_file.probe import Probe, probe
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.text.names import SHOWN
from tickrig.host.text.whole_file import write_whole

_HEAD: Final = """\
# A rig file: what is on the bench. Lines behind a # are proposals.
#   tickrig check {file}
#   tickrig run {file}

seed = 0                        # of all chance
"""
_BUS: Final = """\
[wire.can0]
type = "can"
bitrate = {bit_rate}
"""
_BIT_RATE: Final = 1_000_000
_MOST_NODES: Final = 127
_NO_NAME: Final = re.compile(r"\W+", re.ASCII)


class _TypeRefusedError(ValueError):
    """No device of a type can be made; the message has the reason."""


def rig_template(types: Iterable[str], file: str, folder: Path) -> str:
    """Return the text of a new rig file with devices and all their options.

    Args:
        types: types of the devices, as in a rig file.
        file: name of the new file.
        folder: folder of the new file. Paths of other files are relative to this folder.

    Raises:
        _TypeRefusedError: a device cannot be made.
    """
    made = list(_make(types, folder))
    nodes = [found for _, found in made if found.baud is None]
    parts = [_HEAD.format(file=file)]
    if nodes:
        rates = [each.bit_rate for each in nodes if each.bit_rate]
        parts.append(_BUS.format(bit_rate=rates[0] if rates else _BIT_RATE))
    parts += ["\n".join(_device_lines(*each)) for each in made]
    parts.append("\n".join(_fault_lines(made)))
    parts.append("\n".join(_safe_lines(made)))
    parts.append("\n".join(_door_lines(made)))
    return "\n".join(parts)


def _make(types: Iterable[str], folder: Path) -> Iterator[tuple[DevicePlan, Probe]]:
    """Yield the devices, each with a different name and node-ID."""
    names, node_ids = set[str](), set[int]()
    for given in types:
        try:
            kind, place = kind_of(given, folder)
        except ValueError as error:
            raise _TypeRefusedError(str(error)) from None
        plan = DevicePlan(name=_name(given, names), kind=kind, type=place, wire="")
        found = probe(plan)
        if not isinstance(found, Probe):
            raise _TypeRefusedError(f"{given}: {found[0].reason}")
        node_id = _free(found.node_id or 1, node_ids) if found.baud is None else None
        yield replace(plan, type=given, node_id=node_id), found


def _name(given: str, taken: set[str]) -> str:
    """Return a name that no other device uses."""
    base = given.rpartition(":")[2] if ":" in given else Path(given).stem
    base = _NO_NAME.sub("_", base.lower()).strip("_") or "device"
    if not base[0].isalpha() or base in RESERVED:
        base = f"device_{base}"
    name = base
    while name in taken or name in RESERVED:
        name = f"{base}{len(taken) + 1}"
    taken.add(name)
    return name


def _free(node_id: int, taken: set[int]) -> int:
    while node_id in taken:
        node_id = node_id % _MOST_NODES + 1
    taken.add(node_id)
    return node_id


def _beside(line: str, comment: str) -> str:
    return f"{line:<30}  # {comment}" if comment else line


def _device_lines(plan: DevicePlan, found: Probe) -> Iterator[str]:
    yield f"[device.{plan.name}]"
    yield _beside(f"type = {json.dumps(plan.type)}", found.title)
    if plan.node_id is not None:
        yield f"node_id = {plan.node_id}"
    elif plan.kind is DeviceKind.SERIAL and (options := option_names(plan.type)):
        yield _beside("# config = { }", f"options: {', '.join(options)}")
    yield ""
    inputs = [item for item in _inputs(found) if item.type is not SignalType.FAULT]
    if inputs:
        yield _beside(f"[device.{plan.name}.start]", "its inputs, and signals that drive them")
        yield from map(_input_line, inputs)
        yield ""


def _inputs(found: Probe) -> Iterator[InputSignal]:
    """Yield the inputs, without the objects of a dictionary."""
    table = found.physical.inputs.table
    yield from (table[name] for name in table if not name.startswith("0x"))


def _input_line(item: InputSignal) -> str:
    value = f"{item.initial:g}" if item.real else str(int(item.initial))
    value = '""' if item.type is SignalType.TEXT else value
    unit = f" {item.unit}" if item.unit else ""
    span = "" if item.type is SignalType.TEXT else f" ({item.low:g}..{item.high:g}{unit})"
    return _beside(f"# {item.name} = {value}", f"{item.text}{span}")


def _fault_lines(made: Iterable[tuple[DevicePlan, Probe]]) -> Iterator[str]:
    yield "# [fault]                       # NAME[=ARGUMENT][@FROM[-TO]]"
    for plan, found in made:
        names = [*found.physical.inputs.names(SignalType.FAULT), *found.wire_faults]
        plain = next(each for each in names if _is_plain(found, each))
        shown = ", ".join(names[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
        yield _beside(f'# {plan.name} = "{plain}@2s-3s"', shown)
    yield ""


def _safe_lines(made: Iterable[tuple[DevicePlan, Probe]]) -> Iterator[str]:
    yield "# [safe]                        # outputs when a test is over, looked at by pytest"
    for plan, found in made:
        for item in list(found.physical.outputs.values())[:1]:
            value = json.dumps(found.physical.read(item.name))
            others = ", ".join(list(found.physical.outputs)[1:SHOWN])
            yield _beside(f"# {plan.name}.{item.name} = {value}", others)
    yield ""


def _is_plain(found: Probe, name: str) -> bool:
    """Return whether a fault needs no rate."""
    return name not in found.wire_faults or not found.wire_faults[name].rated


def _door_lines(made: Iterable[tuple[DevicePlan, Probe]]) -> Iterator[str]:
    made = list(made)
    yield "# [real]                        # where hosts find it while 'tickrig run' runs"
    for plan, found in made:
        if found.baud is not None:
            yield f'# {plan.name}.link = "{plan.name}.pty"'
    if any(found.baud is None for _, found in made):
        yield '# can0 = { interface = "socketcan", channel = "vcan0" }'
    yield ""
    yield "# [hardware]                    # where the real devices are"
    for plan, found in made:
        if found.baud is not None:
            yield f'# {plan.name}.port = "/dev/ttyUSB0"'
    if any(found.baud is None for _, found in made):
        yield '# can0 = { interface = "socketcan", channel = "can0" }'
    yield ""


# The command `tickrig init`.

_RIG: Final = "rig.toml"
_STANDARD_OUTPUT: Final = "-"


def init(types: tuple[str, ...], file: Path) -> None:
    """Write a new rig file, or print it if `file` is `-`.

    Args:
        types: types of the devices, as in a rig file.
        file: path of the new file. An existing file is not replaced.
    """
    on_output = str(file) == _STANDARD_OUTPUT
    folder = Path() if on_output else file.parent
    try:
        text = rig_template(types or ("rrc",), _RIG if on_output else file.name, folder)
    except _TypeRefusedError as error:
        raise Refused(f"--device {error}") from None
    if on_output:
        click.echo(text, nl=False)
        return
    if file.exists():
        why = "is there already, and is left alone: -o FILE writes another one"
        raise Refused(f"file {file} {why}")
    try:
        write_whole(file, text)
    except FileNotFoundError:
        why = "cannot be made there" if file.parent.is_dir() else f"no directory {file.parent}"
        raise Refused(f"file {file}: {why}") from None
    except OSError as error:
        refuse_path("file", error)
    click.echo(file)
    words = shlex.quote(str(file))
    click.echo(f"next: edit it; tickrig check {words}; tickrig run {words}", err=True)
