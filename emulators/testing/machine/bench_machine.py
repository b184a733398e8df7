"""Base class of a user's machine for a search: a bench, a host, its rules and invariants."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Final, NamedTuple, TypeVar

from tickrig.emulators.rig.faults import FaultForm, bind_arguments, near_fault
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting

# What may happen on a bench beside the calls of a host: faults, hands at inputs, traffic.


class WorldInput(NamedTuple):
    """An input of a device that a search for failures may change.

    Attributes:
        name: name of the input.
        type: type of the input: `level` or `button`.
        low: smallest value of the input.
        high: largest value of the input.
    """

    name: str
    type: str
    low: float
    high: float


class World:
    """The faults and inputs of a bench with which a search tries to make a host fail.

    Args:
        bench: the bench, in virtual time.
        faults: names of the faults that may occur, with or without arguments. The default is all
            faults.
        inputs: names of the inputs that may change. The default is all inputs, except the objects
            of CANopen nodes.

    Attributes:
        faults: faults that may occur, by name and arguments.
        inputs: inputs that may change.

    Raises:
        ValueError: a fault or an input is unknown.
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
        """Store the present values of the inputs; `calm` restores these values."""
        self._before = {name: self._bench.get(name) for name in self._watched}

    def calm(self) -> None:
        """End all faults, and restore the values of all inputs."""
        for name in self._wire_faults:
            self._bench.clear(name)
        for name, value in self._before.items():
            if self._bench.get(name) != value:
                self._bench.set(name, value)


def _bare(name: str, known: Mapping[str, Any]) -> str:
    """Return the name of a fault that may be written with arguments.

    Raises:
        ValueError: the fault does not accept these arguments.
    """
    bare, has_words, words = name.partition("=")
    form = known.get(bare)
    if not (has_words and isinstance(form, FaultForm) and form.arguments):
        return name
    named = {word.partition("=")[0] for word in words.split(",")}
    if form.bare == ["rate"] and named.isdisjoint(each.name for each in form.arguments):
        return name
    bind_arguments(bare, form, words.split(","))
    return bare


def _known(
    wanted: Sequence[str] | None,
    usual: Sequence[str] | Mapping[str, Any],
    known: Mapping[str, Any],
    noun: str,
) -> list[str]:
    """Return the wanted names, or the usual names if no names are wanted."""
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
            hint = (near_fault if noun == "fault" else near)(name, known)
            raise ValueError(f"no {noun} {name!r}; {hint}")
    return list(wanted)


F = TypeVar("F", bound=Callable[..., Any])

_RULE: Final = "_tickrig_rule"
_INVARIANT: Final = "_tickrig_invariant"


def host_rule(**arguments: object) -> Callable[[F], F]:
    """Decorator for a method of a `BenchMachine` that makes it a rule, which a search may call.

    A rule is an action of the host, such as a request.

    Args:
        arguments: arguments of the method, each with its possible values. The values are a list, a
            tuple or a `range` of plain values, or a strategy of Hypothesis.
    """

    def mark(method: F) -> F:
        setattr(method, _RULE, arguments)
        return method

    return mark


def invariant() -> Callable[[F], F]:
    """Decorator for a method of a `BenchMachine` that makes it an invariant.

    A search calls it after each tick. The method must have no side effects. It raises
    AssertionError if the invariant is violated.
    """

    def mark(method: F) -> F:
        setattr(method, _INVARIANT, True)
        return method

    return mark


class BenchMachine:
    r"""A bench and your host, for random orders of calls, faults and inputs.

    Derive a class from it: make the bench, connect the host, and write a `host_rule` for each
    operation of the host. `check_host` searches for errors; `replay_host` repeats an error that was
    found. Each run begins with the same bench, prepared by `warm_up`, and with a new host.

    Attributes:
        bench: the bench, in virtual time.
        world: the faults and inputs that may change in addition to the host's calls.
        faults: names of possible temporary faults. By default all faults of the bench are possible.
            A name may have arguments: `"sdo_slow=2s"`.
        inputs: names of the inputs and buttons that may change. By default all of the bench may
            change.
        traffic: traffic that other participants may send: frames in candump's notation, or bytes in
            hex to a device. If the bench has several wires, each text has the name of a device as
            prefix: `drive/705#00`.
        fault_for: shortest and longest duration of a fault, such as `("100ms", "300ms")`.
        patience: longest bench time of one call. A longer call is an error, because the host waits
            without end. A smaller value makes a search faster, because each such call takes this
            time.
        longest: longest bench time of a whole run.
        patched: whether `time.sleep` and `time.monotonic` of hosts use the time of the bench.

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
        """Return the bench, in virtual time; a search calls this method once."""
        raise NotImplementedError(f"{type(self).__name__} makes no bench: write make_bench")

    def warm_up(self) -> None:
        """Bring the bench into the state in which each run begins.

        A search calls this method once.
        """

    def connect(self) -> None:
        """Connect the host at the beginning of each run.

        An exception raised here counts as a failure that the search has found.
        """

    def end(self) -> None:
        """Check the result at the end of each run. Override this method for such checks.

        Call `calm` first if all faults should end before the check.
        """

    def disconnect(self) -> None:
        """Close the host's resources after each run, whether the run has failed or not."""

    def calm(self) -> None:
        """End all faults, and restore the values that all inputs had when the run began."""
        self.world.calm()

    @classmethod
    def rules(cls) -> dict[str, Mapping[str, object]]:
        """Return the arguments of the rules, by name of the rule."""
        return {name: getattr(method, _RULE) for name, method in _marked(cls, _RULE)}

    @classmethod
    def invariants(cls) -> list[str]:
        """Return the names of the invariants."""
        return [name for name, _ in _marked(cls, _INVARIANT)]


def _marked(machine: type, mark: str) -> Iterable[tuple[str, Any]]:
    methods = ((name, getattr(machine, name)) for name in sorted(dir(machine)))
    return [(name, method) for name, method in methods if hasattr(method, mark)]
