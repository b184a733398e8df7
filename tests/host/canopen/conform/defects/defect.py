"""What a defect is, and the notation in which they are planted."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tests.device.canopen.reference import NODE_ID
from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import Application, CanopenSlave, ServiceMaker
from tickrig.device.canopen.stack import SERVICES
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode

Bend = Callable[[str], Iterable[str]]
"""Makes frames of a frame, in candump's notation; none lets it vanish."""


class Bends(NamedTuple):
    """What becomes of frames on their way to a slave, and from it."""

    hear: Bend = lambda text: (text,)
    say: Bend = lambda text: (text,)


TOLD: Final = {
    "01": NmtState.OPERATIONAL,
    "02": NmtState.STOPPED,
    "80": NmtState.PRE_OPERATIONAL,
    "81": NmtState.INITIALISING,
    "82": NmtState.INITIALISING,
}
"""The state that an NMT command leads to."""

Plant = Callable[[CanopenSlave], Bends]
"""Plants a defect in a slave that was just made."""


def sound(slave: CanopenSlave) -> Bends:
    """Plant nothing."""
    return Bends()


@dataclass(frozen=True)
class Defect:
    """A slave with one mistake.

    Attributes:
        name: what is wrong with it.
        breaks: checks of which one at least has to fail: theirs is the clause that it breaks.
        plant: how it is planted.
        services: makers of services that take the place of those of a good slave.
        rows: objects that are there beside those of R1, or in place of them.
        needs: optional objects that R1 has to have.
        left: CiA leaves it to the device after all: the checks tell what was seen, and do not fail.
    """

    name: str
    breaks: tuple[str, ...]
    plant: Plant = sound
    services: Mapping[ServiceMaker, ServiceMaker] = field(default_factory=dict)
    rows: tuple[EntryDescription, ...] = ()
    needs: frozenset[str] = frozenset()
    left: bool = False


class DefectiveSlave:
    """A device that bends what a slave hears and says; it listens to all frames."""

    def __init__(self, slave: CanopenSlave, bends: Bends) -> None:
        self.slave, self._bends = slave, bends
        self.tick_us = slave.tick_us

    @property
    def due_us(self) -> int:
        return self.slave.due_us

    def reset(self) -> None:
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        said = self.slave.tick(now_us, _bent(self._bends.hear, rx))
        return _bent(self._bends.say, said)


def make_defective(defect: Defect) -> DefectiveSlave:
    """Make R1 with a defect."""
    rows = {entry.key: entry for entry in make_dictionary(defect.needs).description}
    objects = make_dictionary(defect.needs).objects
    rows |= {row.key: row for row in defect.rows}
    own: dict[ServiceMaker, ServiceMaker] = {Application: application_of(defect.needs)}
    services = tuple({**own, **defect.services}.get(make, make) for make in SERVICES)
    slave = CanopenSlave(Dictionary(rows.values(), objects), NODE_ID, services)
    return DefectiveSlave(slave, defect.plant(slave))


def application_of(needs: frozenset[str]) -> type[Application]:
    """Return the application of R1 with the objects of a profile."""
    if GENERIC_IO in needs:
        return Ds401
    return Ds402 if DRIVE in needs else Application


def _bent(bend: Bend, frames: Frames) -> Frames:
    return tuple(CanFrame.parse(text) for frame in frames for text in bend(str(frame)))


def hears(pattern: str, *templates: str, only: NmtState | None = None) -> Plant:
    """Hear something else than what matches a pattern: templates, as `re.Match.expand` has them."""
    return lambda slave: Bends(hear=_swap(slave, pattern, templates, only))


def says(pattern: str, *templates: str, only: NmtState | None = None) -> Plant:
    """Say something else; nothing without a template."""
    return lambda slave: Bends(say=_swap(slave, pattern, templates, only))


def together(*plants: Plant) -> Plant:
    """Plant one after the other."""

    def plant(slave: CanopenSlave) -> Bends:
        bends = [plant(slave) for plant in plants]
        return Bends(_chain([bend.hear for bend in bends]), _chain([bend.say for bend in bends]))

    return plant


def _chain(bends: list[Bend]) -> Bend:
    def bend(text: str) -> Iterable[str]:
        texts = [text]
        for each in bends:
            texts = [new for old in texts for new in each(old)]
        return texts

    return bend


def _swap(
    slave: CanopenSlave, pattern: str, templates: tuple[str, ...], only: NmtState | None
) -> Bend:
    compiled = re.compile(pattern)
    told = [NmtState.INITIALISING]  # by the commands of this tick too

    def bend(text: str) -> Iterable[str]:
        match = compiled.fullmatch(text)
        state = told[0] if told[0] is only else slave.state
        told[0] = TOLD.get(text[4:6], told[0]) if text.startswith("000#") else slave.state
        if match is None or (only is not None and state is not only):
            return (text,)
        return tuple(match.expand(template) for template in templates)

    return bend


def unguarded(*places: str) -> Plant:
    """Let objects, as `1014:00`, take all that their descriptions allow."""

    def plant(slave: CanopenSlave) -> Bends:
        for place in places:
            _entry(slave, place).guard = None
        return Bends()

    return plant


def tolerant(code: AbortCode, *places: str) -> Plant:
    """Let objects take what they should refuse with one code; other refusals stay."""

    def plant(slave: CanopenSlave) -> Bends:
        for place in places:
            entry = _entry(slave, place)
            entry.guard = _tolerant(entry.guard, code)
        return Bends()

    return plant


def _tolerant(
    guard: Callable[[Entry, Value], None] | None, code: AbortCode
) -> Callable[[Entry, Value], None]:
    def check(entry: Entry, value: Value) -> None:
        try:
            if guard is not None:
                guard(entry, value)
        except SdoAbort as refused:
            if refused.code is not code:
                raise

    return check


def refuses(code: AbortCode, *places: str) -> Plant:
    """Let objects refuse every value."""

    def refuse(entry: Entry, value: Value) -> None:
        raise SdoAbort(code)

    def plant(slave: CanopenSlave) -> Bends:
        for place in places:
            _entry(slave, place).guard = refuse
        return Bends()

    return plant


def acts_as(place: str, value: Callable[[int], int]) -> Plant:
    """Let a slave act as if an object had another value than the one that the bus wrote."""

    def plant(slave: CanopenSlave) -> Bends:
        entry = _entry(slave, place)
        told = [entry.data]
        entry.source = lambda entry: told[0]
        before = entry.written

        def written(entry: Entry) -> None:
            told[0] = entry.data
            number = value(int.from_bytes(entry.data, "little"))
            entry.assign(number.to_bytes(entry.size, "little"))
            if before is not None:
                before(entry)

        entry.written = written
        return Bends()

    return plant


def _entry(slave: CanopenSlave, place: str) -> Entry:
    index, sub = place.split(":")
    return slave.dictionary[int(index, 16), int(sub, 16)]
