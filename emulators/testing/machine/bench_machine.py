"""What a user writes for a search: a bench, a host, its rules, and what must always be so."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Final, NamedTuple, TypeVar

from tickrig.emulators.rig.faults import FaultForm, bind_arguments
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting

# What may happen on a bench beside the calls of a host: faults, hands at inputs, traffic.


class WorldInput(NamedTuple):
    """An input that may change.

    Attributes:
        name: of the input.
        type: `level`, `button`.
        low: its smallest value.
        high: its largest value.
    """

    name: str
    type: str
    low: float
    high: float


class World:
    """The faults and inputs of a bench, as far as they may happen.

    Args:
        bench: the bench, in virtual time.
        faults: names of faults that may come, with arguments if wanted; all unless given.
        inputs: names of inputs that may change; all but the objects of nodes unless given.

    Attributes:
        faults: those that may come, by name and arguments.
        inputs: those that may change.

    Raises:
        ValueError: there is no such fault or input.
    """

    def __init__(
        self, bench: Bench, faults: Sequence[str] | None = None, inputs: Sequence[str] | None = None
    ) -> None:
        self._bench, described = bench, bench.describe()
        forms = described.faults
        table = [
            WorldInput(name, item.type.value, item.low, item.high)
            for name, item in described.inputs.items()
        ]
        movable = {item.name: item for item in table if item.type in ("level", "button")}
        usual = [name for name in movable if not name.rpartition("/")[2].startswith("0x")]
        self.faults = {
            name: forms[_bare(name, forms)] for name in _known(faults, forms, forms, "fault")
        }
        self.inputs = [movable[name] for name in _known(inputs, usual, movable, "input")]
        self._wire_faults = [name for name in forms if name not in described.inputs]
        self._watched = [*usual, *(item.name for item in table if item.type == "fault")]
        self._before: Mapping[str, Setting] = {}

    def begin(self) -> None:
        """Note what inputs are now: `calm` puts them back to it."""
        self._before = {name: self._bench.get(name) for name in self._watched}

    def calm(self) -> None:
        """End all faults, and put all inputs back."""
        for name in self._wire_faults:
            self._bench.clear(name)
        for name, value in self._before.items():
            if self._bench.get(name) != value:
                self._bench.set(name, value)


def _bare(name: str, known: Mapping[str, Any]) -> str:
    """Return the name of a fault that is written with arguments of its own.

    Raises:
        ValueError: arguments that it does not take.
    """
    bare, has_words, words = name.partition("=")
    form = known.get(bare)
    if not (has_words and isinstance(form, FaultForm) and form.arguments):
        return name
    bind_arguments(bare, form, words.split(","))
    return bare


def _known(
    wanted: Sequence[str] | None,
    usual: Sequence[str] | Mapping[str, Any],
    known: Mapping[str, Any],
    noun: str,
) -> list[str]:
    """Return the wanted names, the usual ones if none are given."""
    if wanted is None:
        return list(usual)
    if isinstance(wanted, str):
        raise ValueError(f"{noun}s is a tuple of names: ({wanted!r},), not {wanted!r}")
    for name in wanted:
        if _bare(name, known) not in known:
            bare, rate, _ = name.partition("=")
            if rate and bare in known:
                raise ValueError(
                    f"{noun} {name!r}: the search draws rates, so name {bare!r}; for a rate of"
                    f" yours write a host_rule with self.bench.fault({name!r}, for_='1s')"
                )
            raise ValueError(f"no {noun} {name!r}; {near(name, known)}")
    return list(wanted)


F = TypeVar("F", bound=Callable[..., Any])

_RULE: Final = "_tickrig_rule"
_INVARIANT: Final = "_tickrig_invariant"


def host_rule(**arguments: object) -> Callable[[F], F]:
    """Make a method of a `BenchMachine` something that may happen.

    Args:
        arguments: of the method, each with what it may be: a list, a tuple or a `range` of plain
            values, or a strategy of Hypothesis that draws some.
    """

    def mark(method: F) -> F:
        setattr(method, _RULE, arguments)
        return method

    return mark


def invariant() -> Callable[[F], F]:
    """Make a method of a `BenchMachine` what must always be so: it is called after each tick.

    It only looks, and raises AssertionError where something is not so.
    """

    def mark(method: F) -> F:
        setattr(method, _INVARIANT, True)
        return method

    return mark


class BenchMachine:
    r"""A bench and your host, for random orders of calls, faults and inputs.

    Derive from it: make the bench, connect the host, and write a `host_rule` for each operation of
    the host. `check_host` searches; `replay_host` repeats what it found. Each run begins with the
    same bench, prepared by `warm_up`, and with a host of its own.

    Attributes:
        bench: the bench, in virtual time.
        world: what may happen to the bench besides the host's calls.
        faults: names of possible temporary faults; by default all of the bench. A fault with
            arguments may be written with them: `"sdo_slow=2s"`.
        inputs: names of the inputs and buttons that may change; by default all of the bench.
        traffic: what other participants may send: frames in candump's notation, or bytes in hex to
            a device; with several wires, prefixed by a device: `drive/705#00`.
        fault_for: how long faults stay, such as `("100ms", "300ms")`.
        patience: bench time that one call may take: a host that waits without end is a finding. A
            smaller value makes a search faster, because each such call takes this time.
        longest: bench time that a whole run may take.
        patched: whether `time.sleep` and `time.monotonic` of hosts use the bench's time.

    >>> class Chair(BenchMachine):
    ...     faults = ()
    ...     def make_bench(self):
    ...         return Bench("rrc")
    ...     def connect(self):
    ...         self.link = self.bench.link
    ...     @host_rule(line=[b"device", b"hello"])
    ...     def ask(self, line):
    ...         self.link.send(line + b"\n")
    >>> sorted(Chair.rules())
    ['ask']
    """

    faults: ClassVar[Sequence[str] | None] = None
    inputs: ClassVar[Sequence[str] | None] = None
    traffic: ClassVar[Sequence[str]] = ()
    fault_for: ClassVar[Sequence[str]] = ("20ms", "100ms", "300ms", "1s", "3s")
    patience: ClassVar[str] = "60s"
    longest: ClassVar[str] = "600s"
    patched: ClassVar[bool] = True

    bench: Bench
    world: World

    def make_bench(self) -> Bench:
        """Return the bench, in virtual time; called once in a search."""
        raise NotImplementedError(f"{type(self).__name__} makes no bench: write make_bench")

    def warm_up(self) -> None:
        """Bring the bench to where each run begins; called once."""

    def connect(self) -> None:
        """Connect the host, at the beginning of each run; what it raises is a finding."""

    def end(self) -> None:
        """Judge at the end of each run; `calm` ends all faults first, if that is wanted."""

    def disconnect(self) -> None:
        """Close what the host has open, after each run, whatever came of it."""

    def calm(self) -> None:
        """End all faults, and put all inputs back to what they were when the run began."""
        self.world.calm()

    @classmethod
    def rules(cls) -> dict[str, Mapping[str, object]]:
        """Return the arguments of each rule, by its name."""
        return {name: getattr(method, _RULE) for name, method in _marked(cls, _RULE)}

    @classmethod
    def invariants(cls) -> list[str]:
        """Return the names of what must always be so."""
        return [name for name, _ in _marked(cls, _INVARIANT)]


def _marked(machine: type, mark: str) -> Iterable[tuple[str, Any]]:
    methods = ((name, getattr(machine, name)) for name in sorted(dir(machine)))
    return [(name, method) for name, method in methods if hasattr(method, mark)]
