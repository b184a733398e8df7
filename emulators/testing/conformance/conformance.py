"""The conformance tester as a function, which takes a slave and returns a report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final, cast
from warnings import warn

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.bench.bench import BenchDevice
from tickrig.emulators.testing.conformance.bench_source import (
    SlaveStimulus,
    bench_source,
    describe_slave,
)
from tickrig.emulators.testing.conformance.slave import (
    CalledSlave,
    Crashes,
    Slave,
    SlaveCall,
    checked_frames,
    guarded,
    is_slave,
)
from tickrig.host.canmon.conform.chosen import patterns, unknown
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.conform.conformance import decoded_frames, file_text
from tickrig.host.canmon.conform.stimulus import Consent
from tickrig.host.canopen.conform.binding.capabilities import NodeDescription
from tickrig.host.canopen.conform.bus.exchange import NotAllowed
from tickrig.host.canopen.conform.check import ConformancePlan, Level, Stimulus
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.canopen.eds import open_eds
from tickrig.host.text.page_text import one_line
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.can import Frames
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.instant import NEVER

# A slave with a switch in its supply, for the stimulus `power`.


class PoweredSlave:
    """A CANopen slave under test with a switchable supply, whose exceptions are reported.

    After an exception the program of the slave restarts, as after a watchdog. If the restart fails,
    the slave is dead until the supply is switched.

    Args:
        slave: the slave under test, switched on.

    Attributes:
        on_crash: function that is called with each exception of the slave.
    """

    def __init__(self, slave: Slave) -> None:
        self.slave, self._on = slave, True
        self._woken = self._dead = False
        self.on_crash: Callable[[Exception], object] = lambda error: None

    @property
    def tick_us(self) -> int:
        """The tick of the slave."""
        return self.slave.tick_us

    @property
    def due_us(self) -> int:
        """Time at which the slave is due, or `NEVER` while the slave is off."""
        if not self._on or self._dead:
            return NEVER
        return 0 if self._woken else self.slave.due_us

    def reset(self) -> None:
        """Switch the power off and on."""
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Tick the slave, if it is on."""
        self._woken = False
        if not self._on or self._dead:
            return ()
        try:
            sent = self.slave.tick(now_us, rx)
            return checked_frames(sent) if sent != () else sent
        except Exception as error:
            self._begin_anew(error)
            return ()

    def switch(self, *, on: bool) -> None:
        """Switch the power; do nothing if the power is already in this state."""
        if on and not self._on:
            self._reset()
        self._on = on

    def _begin_anew(self, error: Exception) -> None:
        self.on_crash(error)
        self._reset()

    def _reset(self) -> None:
        self._woken, self._dead = True, False
        try:
            self.slave.reset()
        except Exception as error:
            self._dead = True
            self.on_crash(error)


# Any slave on its own bus, in virtual time.

_BOOT_US = 100_000
"""Time after which the slave has booted."""


class SlaveBench:
    """A CAN bus in virtual time with a slave under test and the conformance tester.

    Args:
        slave: the slave under test.
        bit_rate: bit rate of the bus, 10 000 to 1 000 000 bit/s.
        stimulus: function that sets the inputs of the slave. The bench switches the supply
            (`power`) itself, without this function.

    Attributes:
        source: the open bus with the slave, for the conformance tester.
    """

    def __init__(self, slave: Slave, bit_rate: int, stimulus: Stimulus | None = None) -> None:
        self._slave, self._stimulus = PoweredSlave(slave), stimulus
        wire = CanWire(bit_rate)
        rig = Rig(Station(self._slave, wire.end()))
        self.source = ConformSource(
            CanHost(rig, wire.end()),
            type(slave).__name__,
            "a bus in virtual time",
            bit_rate,
            virtual=True,
            stimulus=lambda node_id: guarded(self.stimulate),
            watch=lambda node_id, run: crashes.watch(run.crash),
        )
        self._slave.on_crash = crashes = Crashes("your slave")
        rig.run_for(_BOOT_US)

    def stimulate(self, *words: str) -> str:
        """Set an input, or switch the supply; raise NotAllowed if this is not supported."""
        if words[0] == "power":
            self._slave.switch(on=words[1] == "on")
            return ""
        if self._stimulus is None:
            raise NotAllowed(f"{' '.join(words)}: no stimulus sets the inputs of this slave")
        return self._stimulus(*words)


BIT_RATE: Final = 1_000_000
_NODE_IDS: Final = range(1, 128)
_LEVELS: Final = tuple(level.word for level in Level)

_Called = Callable[[], SlaveCall]
Node = Slave | CanopenSlave | BenchDevice | _Called
"""Objects that can be tested."""


def conformance(  # noqa: PLR0913 - by keyword
    node: Node,
    *,
    node_id: int | None = None,
    eds: Path | str | EdsFile | None = None,
    level: str = "intrusive",
    only: str | Iterable[str] = (),
    allow: Iterable[int] = (),
    never: Iterable[int] = (),
    stimulus: Stimulus | None = None,
    seed: int = 0,
    bit_rate: int = BIT_RATE,
) -> Report:
    """Test a CANopen slave in virtual time; the same slave gives the same report.

    Args:
        node: a slave, a device or a callable. The slave (`Slave`), such as a slave of
            `tickrig.device`, gets the time as an argument. The device is on a bench in virtual
            time. The callable is called at each power-on; it returns a function that takes the time
            in microseconds and frames, and returns frames.
        node_id: node-ID, 1..127. The default is the node-ID of the slave, if the slave has one.
        eds: EDS, DCF or XDD of the slave. Without a file, slaves of tickrig describe themselves,
            and the tester queries other slaves.
        level: level of the test, which is `read-only`, `communication` or `intrusive`.
            The default is `intrusive`, because nothing real can move in virtual time.
            (`canmon conform` only reads.)
        only: groups or ids of checks, with * and ?, as `"NMT,HB"` or as a sequence. By default all
            checks run.
        allow: indices of profile objects, 6000h..9FFFh, that may be written.
        never: indices of objects that are never written, with priority over `allow`.
        stimulus: function that sets inputs. It is called with `"input", "6000:01", "01"`,
            `"emergency", "5000", "01"` and similar words, and returns the value for `"output",
            NAME`. The function is not called to switch the power of a `Slave`.
        seed: seed of random choices.
        bit_rate: bit rate of the bus, 10 000..1 000 000 bit/s.

    Returns:
        The report; `tickrig.testing.conformance(node).exit_status` is 0 if all checks passed.

    Raises:
        ValueError: the node-ID, the level or a check is missing or invalid.
        OSError: the EDS cannot be read.

    >>> from tickrig.device import make_epos
    >>> conformance(make_epos(5), only="NMT-03").exit_status
    0
    """
    chosen_level, names = level_of(level), names_of(only)
    with closing(_source(node, node_id, bit_rate, stimulus)) as source:
        number = node_id_of(node, node_id)
        plan = ConformancePlan(
            level=chosen_level,
            only=names,
            allow=frozenset(allow),
            never=frozenset(never),
            bit_rate=source.bit_rate,
            seed=seed,
            stimulus=source.stimulus(number) if source.stimulus else None,
            confirm=Consent(yes=False, virtual=True, alone=len(source.nodes) <= 1).confirm,
        )
        file = open_eds(Path(eds)) if isinstance(eds, Path | str) else eds
        known = source.describe(number) if file is None else NodeDescription.of_file(file)
        run = ConformRun(
            *(source.link, number, plan),
            device=known.device if known else None,
            claims=known.claims if known else None,
            source=source.name,
        )
        source.watch(number, run)
        return run.run()


def _source(
    node: Node, node_id: int | None, bit_rate: int, stimulus: Stimulus | None
) -> ConformSource:
    """Return the bus of a node."""
    if isinstance(node, CanopenSlave):  # alone: a bench and its journal took a quarter more
        source = SlaveBench(node, bit_rate, stimulus or SlaveStimulus(node)).source
        own = node.node_id
        return replace(
            source,
            name="can",
            describe=lambda number: describe_slave(node) if number == own else None,
        )
    if isinstance(node, BenchDevice):
        source = bench_source(node._mode, node_id, device=node.name)
        return replace(source, stimulus=lambda number: guarded(stimulus)) if stimulus else source
    if is_slave(node) and not isinstance(node, type):
        return SlaveBench(node, bit_rate, stimulus).source
    return SlaveBench(CalledSlave(cast("_Called", node)), bit_rate, stimulus).source


def level_of(word: str) -> Level:
    """Return the level of a name; raise ValueError if the name is unknown."""
    if word not in _LEVELS:
        raise ValueError(f"level {word!r} is not one of {', '.join(_LEVELS)}")
    return Level(_LEVELS.index(word))


def names_of(only: str | Iterable[str]) -> tuple[str, ...]:
    """Split a selection of conformance checks into the names of groups and single checks.

    Raises ValueError if a name matches no check.
    """
    names = patterns(only)
    for text in unknown(names):
        raise ValueError(f"only {text}")
    return names


def node_id_of(node: Node, node_id: int | None) -> int:
    """Return the given node-ID, or the slave's; raise ValueError if there is no node-ID."""
    if node_id is None and isinstance(node, BenchDevice):
        node_id = int(node.get("node_id"))
    if node_id is None:
        node_id = getattr(node, "node_id", None)
    if node_id is None or node_id not in _NODE_IDS:
        raise ValueError(f"node_id is 1..127, not {node_id}; this slave does not tell it itself")
    return node_id


# A report as text and as files, as from `canmon conform`, for programs.

_KINDS: Final[Mapping[str, str]] = {
    ".html": "--html",
    ".xml": "--junit",
    ".svg": "--badge",
    ".md": "--issue",
    ".txt": "--write-baseline",
}
_JSON: Final = ".json"


def conformance_text(report: Report, *, baseline: Path | str | None = None) -> str:
    """Return a conformance report as text, as `canmon conform` prints it.

    Args:
        report: report that `conformance` has returned.
        baseline: path of a file with known failures, which the text lists without details.

    Raises:
        OSError: the baseline cannot be read.
        ValueError: the baseline is invalid.
    """
    return text_report(report, known_failures(baseline), decoded_frames({}))


def write_conformance(
    report: Report, path: Path | str, *, baseline: Path | str | None = None
) -> None:
    """Write a conformance report to a file, whose suffix selects the format.

    An existing file is replaced only after the new file is complete.

    Args:
        report: report that `conformance` has returned.
        path: path of the file: `.html` is a page with all frames, `.xml` is JUnit, `.svg` is a
            badge, `.md` has the failures as texts for issues, `.json` is JSON, and `.txt` has the
            failures as a baseline.
        baseline: path of a file with known failures.

    Raises:
        OSError: a file cannot be written or read.
        ValueError: the suffix is unknown, or the baseline is invalid.
        ImportError: Jinja2 is needed for a page, but is not installed (extra `report`).
    """
    known, ending = known_failures(baseline), Path(path).suffix
    if ending == _JSON:
        text = report_json(report, known)
    elif ending in _KINDS:
        text = file_text(_KINDS[ending], report, known, decoded_frames({}))
    else:
        endings = ", ".join([*_KINDS, _JSON])
        raise ValueError(f"{path}: unknown format, the suffix is not one of {endings}")
    write_whole(Path(path), text)


def known_failures(path: Path | str | None) -> Baseline:
    """Read a baseline file with known failures of a device, and warn about unknown checks in it.

    Args:
        path: path of the file, or None for no known failures.

    Raises:
        OSError: the file cannot be read.
        ValueError: the baseline is invalid.
    """
    if path is None:
        return NONE_KNOWN
    baseline = Baseline.read(Path(path))
    for text in unknown(sorted(baseline.known)):
        warn(one_line(f"baseline {path}: {text}"), stacklevel=3)
    return baseline
