"""Faults by name: their declarations, and their effect on traffic."""

# Theory of operation.
#
# A fault is declared by one entry of a table, `NAME: FaultType(...)`. The entry holds the
# description, the arguments and the factory of the fault. Everything else is derived from it:
#   - `bind_arguments` reads the text after `NAME=`;
#   - `usage` returns the notation;
#   - `describe` and `tickrig ctl SOCKET faults` list the fault;
#   - the table of docs/reference/bench/faults.md is generated from the entries.
#
# Users write `NAME[=ARGUMENT[,ARGUMENT]]`. A bare argument is the next one of the declaration;
# `KEY=VALUE` names an argument. Each fault that is `rated` also accepts `rate=` (the probability
# that it acts each time it could) and `count=` (how often it acts at most). A fault without
# arguments of its own accepts a bare rate, as in `drop=0.01`. Each argument has a default, so the
# bare name is a valid fault.
#
# A `FaultTrigger` decides when a fault acts: it draws a random number, applies the limit, and
# counts. A fault calls it exactly once each time it could act, so the random numbers are the same
# in each run.

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Final, Generic

from tickrig.device.chance import Chance, check_rate, threshold_of
from tickrig.device.core import W
from tickrig.device.twin import Copyable, Immutable, Listeners
from tickrig.emulators.rig.port import Port
from tickrig.host.text.names import closest, near
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import UartSetting

_RATE, _COUNT = "rate", "count"
_MOST: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class FaultArgument(Immutable):
    """Description of one argument of a fault, such as the argument in `delay=800ms`.

    Attributes:
        name: name of the argument, such as `delay`.
        text: description as readable text.
        default: default value, as a user would write it.
        unit: unit of the value: `time` for a duration, any other text for the unit of a whole
            number, which may be written in hex, or empty for a plain number.
        low: smallest value; for a duration in microseconds.
        high: largest value; for a duration in microseconds.
        choices: allowed words, if the value is a word instead of a number.
        read: function that parses an argument with a special form. It raises ValueError for an
            invalid text.
        bare: whether the value may be written without the name of the argument.
    """

    name: str
    text: str
    default: str
    unit: str = ""
    low: int = 0
    high: int = _MOST
    choices: tuple[str, ...] = ()
    read: Callable[[str], Any] | None = None
    bare: bool = True

    @property
    def range(self) -> str:
        """The allowed values as readable text."""
        if self.choices:
            return " or ".join(self.choices)
        if self.read is not None:
            return self.unit
        if self.unit == "time":
            return f"{_time(self.low)} to {_time(self.high)}"
        return f"{self.low} to {self.high} {self.unit}".rstrip()

    def parse(self, word: str) -> Any:
        """Parse the value of this argument: a time in microseconds, a number or a word.

        If the argument has a function `read`, the value is what `read` returns.

        Raises:
            ValueError: the text has a wrong form, or the value is out of range.
        """
        if self.read is not None:
            return self.read(word)
        if self.choices:
            if word not in self.choices:
                raise ValueError(f"{self.name} {word!r} is not {self.range}")
            return word
        try:
            value = parse_time_with_unit_us(word) if self.unit == "time" else int(word, 0)
        except ValueError as error:
            said = str(error) if self.unit == "time" else f"{word!r} is not a whole number"
            raise ValueError(f"{self.name}: {said}") from None
        if not self.low <= value <= self.high:
            raise ValueError(f"{self.name} {word} is not in {self.range}")
        return value


def _time(us: int) -> str:
    for unit_us, unit in ((1_000_000, "s"), (1_000, "ms")):
        if us and us % unit_us == 0:
            return f"{us // unit_us} {unit}"
    return f"{us} us"


RATE: Final = FaultArgument(_RATE, "probability that it acts each time it could", "1")
COUNT: Final = FaultArgument(_COUNT, "how often it acts at most", "always", low=1)

_WAYS: Final = {"answer": "<", "request": ">", "both": "><"}
WAY: Final = FaultArgument(
    "way", "what the device sends or receives", "answer", choices=tuple(_WAYS)
)
"""Argument of port faults that act in one direction by default."""

EITHER_WAY: Final = replace(WAY, default="both", bare=False)
"""Argument of port faults that act in both directions by default; a bare word is their rate."""


@dataclass(frozen=True, slots=True)
class FaultForm(Immutable):
    """Description of a fault and its arguments.

    The entries of fault tables are objects of subclasses.

    Attributes:
        text: description of the fault as readable text.
        rated: whether the fault also accepts the arguments `rate=` and `count=`. The rate is the
            probability that the fault acts each time it could. The count is the largest number of
            times that it acts.
        arguments: arguments of the fault itself. If the attribute `bare` of an argument is true,
            the value of this argument may be written without a name. Values without names stand in
            the order of the arguments.
        usual_rate: default of `rate`.
    """

    text: str
    rated: bool = field(default=True, kw_only=True)
    arguments: tuple[FaultArgument, ...] = field(default=(), kw_only=True)
    usual_rate: float = field(default=1.0, kw_only=True)

    @property
    def all_arguments(self) -> tuple[FaultArgument, ...]:
        """All arguments with their defaults, including the arguments of every rated fault."""
        if not self.rated:
            return self.arguments
        rate = FaultArgument(_RATE, RATE.text, f"{self.usual_rate:g}", "above 0 to 1", read=float)
        return (*self.arguments, rate, COUNT)

    @property
    def bare(self) -> list[str]:
        """Names of the arguments whose values may be written alone, in this order."""
        own = [each.name for each in self.arguments if each.bare]
        return own or [_RATE] * self.rated


@dataclass(frozen=True, slots=True)
class FaultArguments(Immutable):
    """Parsed arguments of a fault, including the defaults of arguments that were not given.

    Attributes:
        values: parsed values by argument name.
        rate: probability that the fault acts each time it could.
        count: largest number of times that the fault acts, or None for no limit.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    rate: float = 1.0
    count: int | None = None

    def __getitem__(self, name: str) -> Any:
        """Return the value of an argument."""
        return self.values[name]


def usage(name: str, form: FaultForm) -> str:
    """Return the notation of a fault.

    >>> usage("slow", FaultForm("", arguments=(FaultArgument("delay", "", "800ms", "time"),)))
    'slow[=DELAY]'
    >>> usage("drop", FaultForm("")), usage("cut", FaultForm("", rated=False))
    ('drop[=RATE]', 'cut')
    """
    words = form.bare
    return f"{name}[={','.join(words).upper()}]" if words else name


def bind_arguments(name: str, form: FaultForm, words: Sequence[str]) -> FaultArguments:
    """Parse the arguments of a fault, such as `rate=0.1,count=3`.

    Args:
        name: name of the fault, for error messages.
        form: description of the fault with its arguments.
        words: the arguments, each as a text such as `rate=0.1`. The user writes them after the name
            of the fault and `=`, separated by commas.

    Raises:
        ValueError: an argument is unknown, or a value is out of range.

    >>> slow = FaultForm("", arguments=(FaultArgument("delay", "", "800ms", "time"),))
    >>> bind_arguments("slow", slow, ("5ms", "rate=0.1"))
    FaultArguments(values={'delay': 5000}, rate=0.1, count=None)
    """
    given = spelled(name, form, words)
    count = COUNT.parse(given[_COUNT]) if _COUNT in given else None
    rate = _parse_rate(name, given[_RATE]) if _RATE in given else form.usual_rate
    try:
        values = {
            each.name: each.parse(given.get(each.name, each.default)) for each in form.arguments
        }
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    return FaultArguments(values, rate, count)


def spelled(name: str, form: FaultForm, words: Sequence[str]) -> dict[str, str]:
    """Return the given arguments by name; raise ValueError as `bind_arguments` does."""
    known, free = {each.name: each for each in form.all_arguments}, form.bare
    if words and not (free or (known and "=" in words[0])):
        hint = "".join(f"; write {each.name}={each.choices[0]}" for each in known.values())
        hint = "; clear ends it" if tuple(words) == ("0",) else hint
        raise ValueError(f"{name} takes no argument, got {','.join(words)}{hint}")
    given: dict[str, str] = {}
    for word in words:
        key, keyed, value = word.partition("=")
        if not keyed:
            left = [each for each in free if each not in given]
            if not left:
                raise ValueError(f"{word!r} is one argument too many: {usage(name, form)}")
            key, value = left[0], word
        if key not in known:
            raise ValueError(f"{name} has no argument {key!r}; {near(key, known)}")
        if key in given:
            raise ValueError(f"{name} has {key} twice")
        given[key] = value
    return given


_SYNONYMS: Final = (
    # of a CANopen node
    (
        ("heartbeat_mute",),
        "heartbeat_lost heartbeat_missing heartbeat_timeout heartbeat_loss heartbeat_drop"
        " heartbeat_stop heartbeat_off lost_heartbeat missing_heartbeat no_heartbeat",
    ),
    (
        ("sdo_mute", "cut", "bus_unplugged"),
        "sdo_timeout sdo_lost sdo_loss sdo_drop sdo_missing sdo_silent no_sdo sdo_no_answer"
        " sdo_no_response no_answer no_response timeout mute silent",
    ),
    (("sdo_slow", "slow_answer", "delay"), "sdo_late sdo_delay late_answer late latency lag slow"),
    (("sdo_abort",), "sdo_error sdo_refuse sdo_refused sdo_fail sdo_failure abort"),
    (("sdo_toggle",), "toggle toggle_bit toggle_error"),
    (
        ("pdo_mute",),
        "pdo_lost pdo_loss pdo_missing pdo_timeout pdo_drop no_pdo tpdo_lost tpdo_missing",
    ),
    (("pdo_stale",), "pdo_frozen pdo_freeze pdo_stuck frozen stuck"),
    (("pdo_short",), "pdo_length pdo_dlc dlc dlc_error"),
    (("sync_lost",), "no_sync sync_mute sync_missing sync_timeout sync_loss sync_drop"),
    (("boot_late",), "bootup_late boot_up_late boot_slow slow_boot late_boot"),
    (("boots_again",), "reset reboot restart crash watchdog_reset reset_node node_reset"),
    (("emcy_storm",), "emcy emergency emergency_storm"),
    (("id_doubled",), "duplicate_id duplicate_node_id node_id_conflict same_node_id id_conflict"),
    (("bus_off",), "busoff error_passive controller_off"),
    # of a bus or a line
    (
        ("corrupt", "flip", "bus_noise"),
        "bus_error error_frame can_error bit_error bit_flip stuff_error crc_error noise",
    ),
    (
        ("drop",),
        "lost loss lose missing frame_lost frame_loss message_lost packet_loss byte_lost",
    ),
    (("duplicate", "dup"), "double doubled twice"),
    (("babble",), "babbling babbling_idiot flood bus_load"),
    (("framing",), "framing_error frame_error"),
    (("truncate",), "short_answer partial incomplete cut_off"),
    (("garbage",), "junk rubbish"),
    # of a device
    (
        ("power_off", "power_cut"),
        "node_lost lost_node node_off node_offline node_dead node_missing offline dead no_power"
        " power_lost power_loss lost_power power_fail power_failure power_down brownout blackout"
        " supply_off supply_lost",
    ),
    (("power_off",), "power_cut"),
    (("power_cut",), "power_off"),
    (
        ("unplugged", "bus_unplugged", "cut"),
        "unplug cable_cut cable_unplugged can_unplugged disconnect disconnected connection_lost"
        " plug_pulled wire_break",
    ),
    (
        ("shaft_blocked", "jam_left", "motor_jammed"),
        "wheel_blocked motor_blocked blocked stall stalled motor_stalled jam jammed wheel_jammed"
        " rotor_locked locked_rotor shaft_stall shaft_stalled shaft_stuck shaft_jam shaft_jammed"
        " shaft_locked wheel_stuck wheel_stall wheel_stalled motor_stall motor_jam wheel_jam"
        " wheel_locked motor_locked motor_stuck",
    ),
    (
        ("encoder_unplugged", "encoder_unplugged_left"),
        "encoder_lost encoder_broken encoder_error encoder_fault encoder_missing no_encoder",
    ),
    (
        ("motor_phase_open",),
        "open_phase phase_open phase_lost phase_loss motor_unplugged winding_open",
    ),
    (
        ("short_circuit", "short_circuit_left", "short"),
        "overcurrent over_current shorted current_overload motor_short shorted_motor",
    ),
)
"""Faults with the words for which a device suggests the first of them that it has."""


_INPUT_SYNONYMS: Final = (
    (
        ("load_nm", "ambient_c"),
        "overheat overheated overheating overtemperature over_temperature overtemp too_hot hot heat"
        " overload overloaded",
    ),
    (
        ("supply_v",),
        "undervoltage under_voltage low_voltage overvoltage over_voltage high_voltage",
    ),
)
"""Inputs that cause an error without a fault, with the words for which they are suggested."""


def _closest_fault(name: str, names: Iterable[str]) -> list[str]:
    """Return the probable fault: one that the field calls so, or one with a similar name.

    >>> _closest_fault("heartbeat_lost", ["heartbeat_late", "heartbeat_mute"])
    ['heartbeat_mute']
    """
    names, word = list(names), name.rpartition("/")[2]
    there = _by_bare_name(name, names)
    same = (faults for faults, words in _SYNONYMS if word.casefold() in words.split())
    meant = (fault for faults in same for fault in faults)
    found = next((there[fault] for fault in meant if fault in there), "")
    return [found] if found else closest(name, names)


def _by_bare_name(name: str, names: Iterable[str]) -> dict[str, str]:
    """Return the names at the device of `name`, or of all devices, by name without device."""
    device, slash, _ = name.rpartition("/")
    there = dict[str, str]()
    for each in names:
        owner, _, bare = each.rpartition("/")
        if not slash or owner == device:
            there.setdefault(bare, each)
    return there


def near_fault(name: str, names: Iterable[str], inputs: Iterable[str] = ()) -> str:
    """Return a hint for an unknown fault name, such as a similar name, or the names of all faults.

    Some failures, such as overheating, are caused by physical inputs instead of faults. For the
    name of such a failure, the hint suggests these inputs.

    Args:
        name: the unknown name.
        names: names of the known faults.
        inputs: names of the physical inputs.

    >>> near_fault("overheat", ["cut"], ["load_nm", "ambient_c"])
    "set the input 'load_nm' or 'ambient_c'"
    """
    names, word = list(names), name.rpartition("/")[2].casefold()
    there = _by_bare_name(name, inputs)
    for causes, words in _INPUT_SYNONYMS:
        found = [repr(there[cause]) for cause in causes if cause in there]
        if found and word in words.split():
            return f"set the input {' or '.join(found)}"
    close = _closest_fault(name, names)
    return f"did you mean {close[0]!r}?" if close else near(name, names)


def _parse_rate(name: str, text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a rate: write a number up to 1, as 0.001") from None
    check_rate(name, rate)
    return rate


class FaultTally(Copyable):
    """Counts how often a fault has acted, up to an optional limit.

    Args:
        count: largest number of times that the fault acts, or None for no limit.

    Attributes:
        acted: number of times that the fault has acted.
    """

    __slots__ = ("acted", "count")

    def __init__(self, count: int | None = None) -> None:
        self.count, self.acted = count, 0

    @property
    def left(self) -> int:
        """Number of actions that are still allowed."""
        return _MOST if self.count is None else self.count - self.acted

    def allow(self, wanted: int = 1) -> int:
        """Return how many of `wanted` actions the limit still allows, and count these."""
        allowed = min(wanted, self.left)
        self.acted += allowed
        return allowed


class FaultTrigger(Copyable):
    """Decides at each opportunity whether a fault acts, from its rate, count and random numbers.

    Args:
        chance: random generator of the trigger. The fault may also use this generator.
        arguments: arguments of the fault, with rate and count.
        tally: counter that limits how often the fault acts. A fault in both directions has a
            trigger for each direction, and both triggers use the same counter.
    """

    __slots__ = ("chance", "tally", "threshold")

    def __init__(self, chance: Chance, arguments: FaultArguments, tally: FaultTally) -> None:
        self.chance, self.tally = chance, tally
        self.threshold = threshold_of(arguments.rate)

    def hit(self) -> bool:
        """Return whether the fault acts this time, and count the action."""
        return self.chance.hit(self.threshold) and bool(self.tally.allow())

    def hits(self, draws: int) -> list[int]:
        """Return the opportunities (from 0) at which the fault acts, and count the actions."""
        found = self.chance.hits(self.threshold, draws)
        return found[: self.tally.allow(len(found))]


# Faults of a port: each changes the traffic that passes.

Fault = Callable[[int, W], W]
"""Callable that changes the traffic at a time in us: an object with state, not a closure."""


class HoldingFault(ABC, Generic[W]):
    """A fault that holds traffic back and releases it later."""

    @property
    @abstractmethod
    def due_us(self) -> int:
        """Time at which `release` has traffic to return, or `NEVER` if nothing is held."""

    @abstractmethod
    def __call__(self, now_us: int, traffic: W, /) -> W:
        """Accept traffic; return the part that passes at once."""

    @abstractmethod
    def release(self, now_us: int) -> W | None:
        """Return the traffic to release now, or None if there is none."""

    is_late: ClassVar[bool] = False
    """Whether the fault loses no traffic, so that no loss needs to be reported."""

    def sent(self, until_us: int) -> None:
        """Record the time at which the line will have sent the latest released traffic."""

    def pair(self, other: HoldingFault[W]) -> None:
        """Share common state with the fault of the other direction."""

    def end(self) -> None:
        """Stop acting, but release held traffic at its time; called only if `is_late`."""

    def take_over(self, other: HoldingFault[W]) -> None:
        """Take over the held traffic of the fault that this fault replaces."""


@dataclass(frozen=True, slots=True)
class FaultType(FaultForm, Generic[W]):
    """Type of a wire fault, which can be armed by its name at a port.

    Attributes:
        make: function that gets a trigger and the arguments of the fault. It returns the fault,
            which changes the traffic in one direction.
        uart_error: error that a UART detects each time the fault acts: `framing`, `parity`,
            `breaks`.
    """

    make: Callable[[FaultTrigger, FaultArguments], Fault[W]]
    uart_error: str = field(default="", kw_only=True)


class FaultyPort(Copyable, Generic[W]):
    """A port that applies armed faults to its traffic, in the order of arming.

    Each direction has its own random numbers, which are drawn only for traffic. So the numbers do
    not depend on the other direction or on ticks without traffic.

    Args:
        port: the port with the traffic.
        fault_types: the faults that can be armed, by name.
        seed: seed of the random numbers.

    Attributes:
        seed: seed of the random numbers. A new seed applies to faults armed later.
        drawn: whether a random fault was ever armed.
        listeners: functions that are called if the faults change traffic, with the time, the
            direction, the sent traffic and the traffic after the faults. A twin has no listeners.
    """

    def __init__(
        self, port: Port[W], fault_types: Mapping[str, FaultType[W]], seed: int = 0
    ) -> None:
        self._port, self.seed, self.drawn = port, seed, False
        self._setting: UartSetting | None = None  # that of the device, behind what is held
        self.fault_types = fault_types
        self._to_device: dict[str, Fault[W]] = {}
        self._from_device: dict[str, Fault[W]] = {}
        self._tallies: dict[str, FaultTally] = {}
        self._ending: list[str] = []  # late faults that were cleared and still hold traffic
        self.listeners: Listeners[Callable[[int, Mark, W, W], None]] = Listeners()

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the armed faults."""
        return tuple(name for name in self._to_device if name not in self._ending)

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed with these arguments."""
        bind_arguments(name, self.fault_types[name], arguments)

    def arm(self, name: str, *arguments: str) -> None:
        """Arm a fault at this port, in place of an armed fault with the same name.

        Args:
            name: name of the fault.
            *arguments: arguments of the fault as texts, such as `rate=0.1`.

        Raises:
            KeyError: no fault has this name.
            ValueError: an argument is unknown, or a value is out of range.
        """
        fault_type = self.fault_types[name]
        bound = bind_arguments(name, fault_type, arguments)
        tally = self._tallies[name] = FaultTally(bound.count)
        self.drawn |= bound.rate < 1
        ways = _WAYS[bound.values.get(WAY.name, "both")]
        there, back = (
            fault_type.make(FaultTrigger(Chance(self.seed, f"{name} {way}"), bound, tally), bound)
            if way in ways
            else _unchanged
            for way in "><"
        )
        if isinstance(there, HoldingFault) and isinstance(back, HoldingFault):
            there.pair(back)
        for faults, fault in ((self._to_device, there), (self._from_device, back)):
            before = faults.get(name)
            if isinstance(fault, HoldingFault) and isinstance(before, type(fault)):
                fault.take_over(before)
            elif isinstance(before, HoldingFault) and before.is_late and _holds(before):
                before.end()  # the new one is of the other direction
                continue
            faults[name] = fault
        if name in self._ending:
            self._ending.remove(name)

    def acted(self, name: str) -> int:
        """Return how often a fault has acted since it was last armed."""
        return self._tallies[name].acted if name in self._tallies else 0

    def clear(self, name: str) -> None:
        """End an armed fault; do nothing if the fault is not armed.

        If the fault delays traffic without loss, the delayed traffic still arrives at its delayed
        time, and before all later traffic. If the fault holds back traffic for another reason, this
        traffic is lost.
        """
        for faults in (self._to_device, self._from_device):
            fault = faults.get(name)
            if isinstance(fault, HoldingFault) and fault.is_late and _holds(fault):
                fault.end()
                if name not in self._ending:
                    self._ending.append(name)
        self._forget(name)

    def _forget(self, name: str) -> None:
        """Remove a cleared fault, once neither direction holds traffic."""
        both = (self._to_device, self._from_device)
        if name in self._ending:
            if any(_holds(faults[name]) for faults in both):
                return
            self._ending.remove(name)
        for faults in both:
            faults.pop(name, None)

    @property
    def due_us(self) -> int:
        """Time at which the next traffic arrives at the port, or a fault releases traffic."""
        due_us = self._port.due_us
        for faults in (self._to_device, self._from_device):
            for fault in faults.values():
                if isinstance(fault, HoldingFault):
                    due_us = min(due_us, fault.due_us)
        return due_us

    def poll(self, now_us: int, /) -> W:
        """Return the traffic that has arrived, after faults."""
        if (held := self._release(Mark.FROM_DEVICE, self._from_device, now_us)) is not None:
            self._port.send(now_us, held)
            self._report_sent(now_us)
        if self._setting is not None:
            self.use_uart(now_us, self._setting)
        left = self._suffer(Mark.TO_DEVICE, self._to_device, now_us, self._port.poll(now_us))
        late = self._release(Mark.TO_DEVICE, self._to_device, now_us)
        for name in tuple(self._ending):
            self._forget(name)
        return left if late is None else late + left  # type: ignore[operator] # bytes or frames

    def send(self, now_us: int, traffic: W, /) -> None:
        """Send the traffic of one tick after faults."""
        left = self._suffer(Mark.FROM_DEVICE, self._from_device, now_us, traffic)
        self._port.send(now_us, left)
        if left and self._from_device:
            self._report_sent(now_us)

    def _report_sent(self, now_us: int) -> None:
        """Report to holding faults when the line will have sent the released traffic."""
        sent_us: int = getattr(self._port, "sent_us", NEVER)
        for fault in self._from_device.values():
            if isinstance(fault, HoldingFault):
                fault.sent(now_us if sent_us == NEVER else sent_us)

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Change the UART setting of the device.

        If a fault holds back traffic of the device, the change happens after this traffic has been
        released. The method does not wait for this.

        Args:
            now_us: present time in microseconds.
            setting: the new setting.
        """
        held = any(map(_holds, self._from_device.values()))
        self._setting = setting if held else None
        if not held:
            self._port.use_uart(now_us, setting)  # type: ignore[attr-defined] # of a ByteEnd

    def _suffer(self, mark: Mark, faults: Mapping[str, Fault[W]], now_us: int, traffic: W) -> W:
        if not (faults and traffic):
            return traffic
        left = told = traffic
        for name, fault in faults.items():
            if left:
                acted = self.acted(name)
                left = fault(now_us, left)
                self._note_uart_errors(mark, name, self.acted(name) - acted)
                if not _is_late(fault):
                    told = left
        self._notify(now_us, mark, traffic, told)
        return left

    def _note_uart_errors(self, mark: Mark, name: str, count: int) -> None:
        error = self.fault_types[name].uart_error
        if error and count:
            for hear in self._port.uart.error_listeners:  # type: ignore[attr-defined] # of a ByteEnd
                hear(mark, error, count)

    def _release(self, mark: Mark, faults: Mapping[str, Fault[W]], now_us: int) -> W | None:
        """Return the traffic that faults release now; later faults also act on it."""
        released: W | None = None
        for name, fault in faults.items():
            if released:
                before, acted = released, self.acted(name)
                released = fault(now_us, released)
                self._note_uart_errors(mark, name, self.acted(name) - acted)
                if not _is_late(fault):
                    self._notify(now_us, mark, before, released)
            if isinstance(fault, HoldingFault) and fault.due_us <= now_us:
                held = fault.release(now_us)
                if held is not None:
                    released = held if released is None else released + held
        return released

    def _notify(self, now_us: int, mark: Mark, traffic: W, left: W) -> None:
        if left != traffic:
            for hear in self.listeners:
                hear(now_us, mark, traffic, left)


def _unchanged(now_us: int, traffic: W) -> W:
    """Return the traffic unchanged, for the direction in which a fault does not act."""
    return traffic


def _holds(fault: object) -> bool:
    return isinstance(fault, HoldingFault) and fault.due_us < NEVER


def _is_late(fault: object) -> bool:
    return isinstance(fault, HoldingFault) and fault.is_late
