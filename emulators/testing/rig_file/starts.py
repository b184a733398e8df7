"""`[device.NAME.start]` and `[signal.NAME]`: inputs at the start, and what drives them.

`[safe.NAME]`: outputs at the end.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.testing.rig_file.probe import UNKNOWN
from tickrig.emulators.testing.rig_file.schema import check_name
from tickrig.emulators.testing.signals.scope import SLASH, check_signals
from tickrig.emulators.testing.signals.sources import Constant, SignalSpec
from tickrig.emulators.testing.signals.spec_reader import FORMS, read_signal_spec
from tickrig.host.text.names import closest, near
from tickrig.host.text.section import Section, is_broken, shown
from tickrig.host.text.toml_reader import TomlPath
from tickrig.host.text.values import Setting

_OBJECT: Final = "0x"
"""How the names of objects of a node begin."""

Start = dict[str, Setting | SignalSpec]

_UNREAD = SignalSpec(Constant(0.0))
"""In place of a signal that cannot be read, so that formulas find its name."""


class StartReader:
    """Reads starts and signals, and judges them together.

    Args:
        folder: where files of tables are looked for.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._signals: dict[str, SignalSpec] = {}
        self._places: dict[str, tuple[Section, TomlPath]] = {}

    def read_signals(self, section: Section) -> dict[str, SignalSpec]:
        """Read `[signal]`."""
        for name, value in section.values.items():
            try:
                check_name(name)
            except ValueError as error:
                section.wrong(str(error), name)
            self._keep(
                name, self._spec(section, (name,), value) or _UNREAD, section, (name,), value
            )
        return dict(self._signals)

    def read_start(self, device: str, section: Section, physical: HasSignals) -> Start:
        """Read the start of a device.

        Args:
            device: its name.
            section: the table.
            physical: what it has.
        """
        start: Start = {}
        names: list[str] = []  # a node has many objects
        if physical is UNKNOWN:
            section = replace(section, values=_without_lists(section.values))
        for keys, name, value in self._inputs(section, physical.inputs.groups):
            if name in start:
                section.wrong(f"{name} is given twice", *keys)
            elif name not in (table := physical.inputs.table):
                names = names or [*physical.inputs.groups, *table]
                if name in physical.outputs:
                    section.wrong(f"{name} is an output: it can be read, not set", *keys)
                    continue
                section.wrong(f"no input {shown(name)}; {near(name, _alike(name, names))}", *keys)
            elif (found := self._value(section, keys, value, f"{device}{SLASH}{name}")) is not None:
                start[name] = found
                if not isinstance(found, SignalSpec):
                    _check(section, keys, physical, name, found)
        return start

    def check(self, devices: Mapping[str, HasSignals]) -> None:
        """Note what is wrong with signals together: names that nothing has, ranges, circles."""
        for mistake in check_signals(self._signals, devices):
            section, keys = self._places[str(mistake.keys[0])]
            section.wrong(mistake.reason, *keys)

    def _inputs(
        self, section: Section, groups: Mapping[str, tuple[str, ...]]
    ) -> Iterator[tuple[TomlPath, str, Any]]:
        """Yield each input with the keys of its value; a group gives several."""
        for name, value in section.values.items():
            members = groups.get(name)
            if members is None:
                yield (name,), name, value
            elif isinstance(value, list) and len(value) == len(members):
                for at, (member, each) in enumerate(zip(members, value, strict=True)):
                    yield (name, at), member, each
            elif not is_broken(value):
                wanted = f"[{', '.join(members)}]"
                came = f"{len(value)} values" if isinstance(value, list) else shown(value)
                section.wrong(f"it takes {wanted}, not {came}", name)

    def _value(
        self, section: Section, keys: TomlPath, value: Any, full: str
    ) -> Setting | SignalSpec | None:
        """Return a value, or a signal, which is kept to be checked; None if it is noted."""
        if isinstance(value, bool | int | float | str):
            return int(value) if isinstance(value, bool) else value
        spec = self._spec(section, keys, value)
        if spec is not None:
            self._keep(full, spec, section, keys, value)
        return spec

    def _keep(
        self, name: str, spec: SignalSpec, section: Section, keys: TomlPath, value: Any
    ) -> None:
        """Keep a signal with the key that says what it is."""
        form = [key for key in FORMS if isinstance(value, dict) and key in value]
        self._signals[name], self._places[name] = spec, (section, (*keys, *form[:1]))

    def _spec(self, section: Section, keys: TomlPath, value: Any) -> SignalSpec | None:
        if is_broken(value):
            return None
        spec = read_signal_spec(value, keys, self._folder)
        if isinstance(spec, SignalSpec):
            return spec
        depth = len(keys)
        misspelt = [str(each[depth]) for each, _ in spec if each[depth:] and each[depth] in value]
        for mistake in spec:
            missing = mistake.keys[depth:]
            if not (missing and missing[0] not in value and closest(str(missing[0]), misspelt)):
                section.wrong(mistake.reason, *mistake.keys)
        return None


def read_safe(section: Section, devices: Mapping[str, HasSignals]) -> dict[str, dict[str, Setting]]:
    """Read `[safe]`: for each device outputs, and what they are when a test is over.

    Args:
        section: the table.
        devices: by name.
    """
    safe: dict[str, dict[str, Setting]] = {}
    for device, table in section.subs():
        if device not in devices:
            section.unknown(f"no device {device!r}; {near(device, devices)}", device)
        elif table is not None:
            physical = devices[device]
            safe[device] = {
                name: int(value) if isinstance(value, bool) else value
                for name, value in table.values.items()
                if _can_be_safe(table, physical, name)
            }
    return safe


def _can_be_safe(section: Section, physical: HasSignals, name: str) -> bool:
    """Return whether an output or input can be this; else it is noted."""
    value = section.values[name]
    if is_broken(value):
        return False
    if name not in physical.outputs and name not in physical.inputs.table:
        names = [*physical.outputs, *physical.inputs.table]
        section.wrong(f"no output {shown(name)}; {near(name, _alike(name, names))}", name)
        return False
    if not isinstance(value, bool | int | float | str):
        section.wrong(f"it takes a number or a text, not {shown(value)}", name)
        return False
    is_text = isinstance(read_signal(physical, name), str)
    if physical is not UNKNOWN and is_text != isinstance(value, str):
        section.wrong(f"it is a {'text' if is_text else 'number'}, not {shown(value)}", name)
        return False
    return True


def _alike(name: str, names: Iterable[str]) -> list[str]:
    """Leave objects out where none is meant, and else those that begin otherwise."""
    if name.startswith(_OBJECT):
        return [each for each in names if each.startswith(name[:4])]
    return [each for each in names if not each.startswith(_OBJECT)]


def _without_lists(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return all values but those that may be groups."""
    return {name: value for name, value in values.items() if not isinstance(value, list)}


def _check(
    section: Section, keys: TomlPath, physical: HasSignals, name: str, value: Setting
) -> None:
    try:
        physical.inputs.check(name, value)
    except ValueError as error:
        section.wrong(str(error), *keys)
