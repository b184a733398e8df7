"""The conformance tester as a function: any slave in virtual time in, a report out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final, cast

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.testing.bench.bench_device import BenchDevice
from tickrig.emulators.testing.conformance.bench_source import bench_source, eds_of
from tickrig.emulators.testing.conformance.called_slave import CalledSlave
from tickrig.emulators.testing.conformance.crash import guarded
from tickrig.emulators.testing.conformance.slave import Slave, SlaveCall, is_slave
from tickrig.emulators.testing.conformance.slave_bench import SlaveBench
from tickrig.emulators.testing.conformance.slave_stimulus import SlaveStimulus
from tickrig.host.canmon.conform.chosen import patterns, unknown
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.conform.consent import Consent
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.plan import Plan, Stimulus
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile

BIT_RATE: Final = 1_000_000
NODE_IDS: Final = range(1, 128)
LEVELS: Final = tuple(level.word for level in Level)

Called = Callable[[], SlaveCall]
Node = Slave | CanopenSlave | BenchDevice | Called
"""What can be judged."""


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
    """Judge a CANopen slave in virtual time; the same slave gives the same report.

    Args:
        node: a slave that is told the time (`Slave`), as those of `tickrig.device` are; a device
            of a bench in virtual time; or a callable that makes, at each power-on, a callable
            which takes the time in microseconds and frames, and returns frames.
        node_id: 1..127; that of the slave unless given, if it has one.
        eds: its EDS, DCF or XDD; without one our slaves tell of themselves, others are asked.
        level: `read-only`, `communication` or `intrusive`. Unless given it is `intrusive`, where
            `canmon conform` only reads: in virtual time nothing can move.
        only: groups or ids of checks, with * and ?, as `"NMT,HB"` or one by one; all unless given.
        allow: indices of profile objects, 6000h..9FFFh, that may be written.
        never: indices of objects that are never written, whatever else is allowed.
        stimulus: moves inputs: takes `"input", "6000:01", "01"`, `"emergency", "5000", "01"` and
            such, returns what `"output", NAME` asks for; of a `Slave` power is switched here.
        seed: of what is left to chance.
        bit_rate: of the bus, 10 000..1 000 000 bit/s.

    Returns:
        What was judged; `tickrig.testing.conformance(node).exit_status` is 0 where all passed.

    Raises:
        ValueError: a node-ID, level or check that cannot be, or that nobody knows.
        OSError: the EDS cannot be read.

    >>> from tickrig.device import make_epos
    >>> conformance(make_epos(5), only="NMT-03").exit_status
    0
    """
    chosen_level, names = level_of(level), names_of(only)
    with closing(_source(node, node_id, bit_rate, stimulus)) as source:
        number = node_id_of(node, node_id)
        plan = Plan(
            level=chosen_level,
            only=names,
            allow=frozenset(allow),
            never=frozenset(never),
            bit_rate=source.bit_rate,
            seed=seed,
            stimulus=source.stimulus(number) if source.stimulus else None,
            confirm=Consent(yes=False, virtual=True, alone=len(source.nodes) <= 1).confirm,
        )
        file = _eds(eds) or source.eds.get(number)
        device = None if file is None else read_device(file)
        run = ConformRun(source.link, number, plan, device=device, eds=file, source=source.name)
        source.watch(number, run)
        return run.run()


def _source(
    node: Node, node_id: int | None, bit_rate: int, stimulus: Stimulus | None
) -> ConformSource:
    """Return the bus on which a node is."""
    if isinstance(node, CanopenSlave):  # alone: a bench and its journal took a quarter more
        source = SlaveBench(node, bit_rate, stimulus or SlaveStimulus(node)).source
        name = f"node{node.node_id}"
        return replace(source, name="can", eds={node.node_id: eds_of(node, f"{name}.eds")})
    if isinstance(node, BenchDevice):
        source = bench_source(node._mode, node_id, device=node.name)
        return replace(source, stimulus=lambda number: guarded(stimulus)) if stimulus else source
    if is_slave(node) and not isinstance(node, type):
        return SlaveBench(node, bit_rate, stimulus).source
    return SlaveBench(CalledSlave(cast("Called", node)), bit_rate, stimulus).source


def level_of(word: str) -> Level:
    """Return a level; ValueError if it is none."""
    if word not in LEVELS:
        raise ValueError(f"level {word!r} is none of {', '.join(LEVELS)}")
    return Level(LEVELS.index(word))


def names_of(only: str | Iterable[str]) -> tuple[str, ...]:
    """Return groups and ids, each for itself; ValueError if one names no check."""
    names = patterns(only)
    for text in unknown(names):
        raise ValueError(f"only {text}")
    return names


def node_id_of(node: Node, node_id: int | None) -> int:
    """Return the node-ID that was given, or that of the slave; ValueError if there is none."""
    if node_id is None and isinstance(node, BenchDevice):
        node_id = int(node.get("node_id"))
    if node_id is None:
        node_id = getattr(node, "node_id", None)
    if node_id is None or node_id not in NODE_IDS:
        raise ValueError(f"node_id is 1..127, not {node_id}; this slave does not tell it itself")
    return node_id


def _eds(eds: Path | str | EdsFile | None) -> EdsFile | None:
    return open_eds(Path(eds)) if isinstance(eds, Path | str) else eds
