"""A CANopen slave: services and an application around an object dictionary."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from operator import attrgetter, itemgetter
from typing import Final, NamedTuple, Self

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.horizon import Horizon
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank
from tickrig.device.twin import Copyable, Listeners
from tickrig.wire.can import CanFrame, ErrorState, Frames, data_frame
from tickrig.wire.canopen.datatypes import TimeOfDay
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.instant import NEVER

# Theory of operation
# ===================
#
# A slave is a dictionary, an NMT state and a list of services. Services know the node and the
# dictionary; with few exceptions they do not know each other. One service informs another through
# an entry (`watch`, `guard`, `written`, `source`) or through the node (`emergency`, `enter`,
# SYNC).
#
# A tick has two halves:
#
# 1. Frames are handled one after the other, in their order on the wire. Each frame goes to the
#    handler of its CAN-ID and takes effect at once. An NMT command between two PDOs applies to
#    the second PDO only. An SDO that changes a mapping applies to the next frame of the same
#    tick.
# 2. Services that are due act in the order of their slots (stack.py has the order and its
#    reasons). A service that is woken by an earlier service acts in the same tick. A service that
#    is woken by a later one acts in the next tick.
#
# Then the frames of the tick are sent, sorted by CAN-ID. Frames with the same CAN-ID keep the
# order in which they were made. Therefore nothing may depend on the order in which services call
# `send`.
#
# `handlers(state)` is called only in `rewire`. Code that changes its result (a COB-ID, a
# transmission type, the state) must call `rewire`; otherwise the slave listens to the old
# CAN-IDs. `rewire` also sets `accepts`, which keeps the bus from delivering other frames.
#
# A frame in the middle of a tick may change `accepts` after the bus has already filtered the
# frames that follow. Therefore `reconfigured_by` names the CAN-IDs of frames that may do so, and
# the bus passes all frames after such a frame. A service whose frames can lead to `rewire` must
# name their CAN-IDs in `reconfigured_by`.
#
# Time: a service requests its `tick` by `schedule`, and gets it only then. `due_us` is the
# earliest of these times; a rig in virtual time jumps to it. Waking too early is harmless,
# because each service checks its own deadlines. Waking too late is an error that shows only in
# virtual time.
#
# A reset runs these steps; their order must not change:
#
# 1. the pending node-ID becomes the node-ID
# 2. entries of the area get their stored or default values; watchers run while the node is still
#    in the old state
# 3. `enter(INITIALISING)`: services are notified of the end of the old state
# 4. all schedules are dropped (also those of step 2), then each service runs `start` with the new
#    values
# 5. `rewire`, then `booted` in slot order: NMT sends the boot-up message and enters
#    Pre-operational; the first period of the heartbeat starts afterwards
#
# A slave without a node-ID (FFh) omits `booted` in step 5: only LSS listens. `reset` (loss of
# power) only records that power was lost. The first tick afterwards is the power-on, and frames
# that came before it are dropped.
#
# The tick of 1 ms is a choice. All other facts about states and services are from CiA 301, cited
# at each service. Speed matters in this file more than in most others: a network of 127 slaves
# runs this loop 127 times a millisecond. `__slots__`, tuples in place of lists and positions in
# place of names in `tick` are optimizations with measured gains, noted beside them.

# What a slave keeps when its power is cut.


@dataclass(slots=True)
class Nonvolatile:
    """The non-volatile memory of a slave, whose content an emulator may keep in a file.

    Attributes:
        parameters: values stored by 1010h, as bytes. The key is index << 8 | sub-index.
        node_id: node-ID stored by LSS, or None if LSS has stored none.
        bit_rate_index: bit timing index stored by LSS, or None if LSS has stored none.
        version: number of changes up to now. An emulator compares it to know when to write its
            file.
        program: program that was downloaded by 1F50h. It is empty if the program was cleared, or
            None if the slave has its built-in program.
    """

    parameters: dict[int, bytes] = field(default_factory=dict)
    node_id: int | None = None
    bit_rate_index: int | None = None
    version: int = 0
    program: bytes | None = None

    def changed(self) -> None:
        """Count a change after storing or erasing."""
        self.version += 1


# What all services of a slave have in common.

Handler = Callable[[CanFrame], None]

ALIVE = (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL)
ALWAYS = (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED)


@mypyc_attr(allow_interpreted_subclasses=True)
class Service(Copyable):
    """Base class of the communication services of a slave: SDO server, PDOs, SYNC and others.

    When a service is made, it searches the dictionary for its objects, and attaches its callbacks
    to their entries. An entry calls its `guard` to check a value from the bus, its `written` after
    a write by the bus, and its `source` to get the bytes for a read. If the dictionary lacks the
    object of the service, the service is off.

    Attributes:
        node: slave that the service belongs to.
        slot: number of the service. In a tick the services act in the order of these numbers.
        asked_us: time at which `tick` is due, or `NEVER` if it is not scheduled. `schedule` sets
            this time.
    """

    __slots__ = ("_asks", "asked_us", "node", "slot")

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        self.node, self.slot, self.asked_us = node, slot, NEVER
        self._asks = False  # whether it has ever asked for a tick

    @classmethod
    def of(cls, node: CanopenSlave) -> Self:
        """Return the service of this class in a slave, as in `PdoProducer.of(slave)`.

        Args:
            node: the slave.

        Returns:
            The first service of this class in the slave.

        Raises:
            StopIteration: the slave has no service of this class.
        """
        return next(service for service in node.services if isinstance(service, cls))

    def power_on(self) -> None:
        """Reset the state that only a power cut resets."""

    def start(self) -> None:
        """Restart after Reset communication, when the dictionary holds power-on values."""

    def booted(self) -> None:
        """Act at the end of Initialising, in a slave that has a node-ID."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Yield the CAN-IDs of the data frames that the service receives in an NMT state.

        The slave calls this method to learn which function handles which frame.

        Args:
            state: present NMT state.

        Yields:
            CAN-IDs, each with the handler of its frames.
        """
        return iter(())

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Yield the CAN-IDs of the remote frames that the service receives in an NMT state.

        Args:
            state: present NMT state.

        Yields:
            CAN-IDs, each with the handler of its frames.
        """
        return iter(())

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Yield the CAN-IDs of frames that may change the acceptance filter of the slave.

        The emulated bus has an acceptance filter for each slave. After a frame with a yielded
        CAN-ID, the filter of this slave is open for all frames until the slave has handled the
        frame.

        Args:
            state: present NMT state.

        Yields:
            CAN-IDs of the frames.
        """
        return iter(())

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """React to a change of the NMT state. The slave calls this method after the change.

        Args:
            old: state before the change.
            new: the present state.
        """

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """React to an error of the device, which was raised by `CanopenSlave.emergency`.

        Args:
            code: emergency error code.
            register: bits of the error register 1001h.
            text: manufacturer-specific bytes.
        """

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """React to the end of an error, which was cleared by `CanopenSlave.emergency_clear`.

        Args:
            code: emergency error code.
            text: manufacturer-specific bytes of the error, or None for all errors with this code.
        """

    def communication_error(self) -> None:
        """React to a lost heartbeat, a life guarding event or bus-off (CiA 301, 1029h:01)."""

    def bus_state(self, state: ErrorState) -> None:
        """React to a change of the CAN controller's error state.

        Args:
            state: new state: error active, error passive or bus-off.
        """

    def tick(self, now_us: int) -> None:
        """Do the work that is due. The slave calls this method in the scheduled tick.

        Args:
            now_us: time of the tick.
        """

    def follow_cob_id(self, entry: Entry) -> None:
        """Update the CAN-IDs that the slave receives after a COB-ID has changed.

        Services attach this method as a watcher to the entries of their COB-IDs.

        Args:
            entry: entry of the COB-ID, which has changed.
        """
        self.node.rewire()

    def schedule(self, due_us: int) -> None:
        """Request one call of `tick`. This replaces an earlier request.

        Args:
            due_us: time of the call, or `NEVER` for no call.
        """
        self.node.await_tick(self, due_us)


# Which of the services of a slave handle which frames.

_REMOTE: Final = 0x2000_0000

_shared: Final[Callable[[frozenset[int]], frozenset[int]]] = lru_cache(frozenset)
"""Return the set of CAN-IDs; slaves with the same CAN-IDs share one set, which stays cached."""


def _frame_handlers(services: Iterable[Service], state: NmtState) -> dict[int, Handler]:
    """Return the handlers by CAN-ID, or by `REMOTE | CAN-ID` for remote frames."""
    handlers: dict[int, Handler] = {}
    for service in services:
        for can_id, handler in service.handlers(state):
            first = handlers.get(can_id)
            # A named tuple and not a closure: a slave is copied by pickle (`device/twin`).
            handlers[can_id] = _Both(first, handler).handle if first else handler
        for can_id, handler in service.remote_handlers(state):
            handlers[_REMOTE | can_id] = handler
    return handlers


class _Both(NamedTuple):
    """Two handlers of one CAN-ID, which two services receive."""

    first: Handler
    second: Handler

    def handle(self, frame: CanFrame) -> None:
        self.first(frame)
        self.second(frame)


# A CANopen slave: dictionary, NMT state and services, one step a tick.

TICK_US: Final = 1_000
UNCONFIGURED: Final = 0xFF
"""Node-ID of a slave that waits for LSS (CiA 305)."""

COMMUNICATION_AREA: Final = range(0x1000, 0x2000)

_slot = attrgetter("slot")
_priority = itemgetter(0)
"""Priority of a data frame: its CAN-ID. Frames of one tick are sorted by priority, as in the
mailboxes of a CAN controller. On the wire `emulators/can/arbitration.py` decides."""

ServiceMaker = Callable[["CanopenSlave", int], Service]


class CanopenSlave(Copyable):
    """A `Device[Frames]` that is a CANopen slave (CiA 301).

    Frames of a tick are handled in their order on the wire. Then services act in the order of the
    list: SYNC, RPDO, SDO, application, TPDO, EMCY, heartbeat. The frames that one tick sends are
    sorted by priority, that is by CAN-ID; frames with the same CAN-ID keep their order.

    Not emulated: the time that a real slave's processor needs.

    Args:
        dictionary: the objects, which determine the services.
        node_id: node-ID 1..127, or `UNCONFIGURED`. A node-ID that LSS has stored takes precedence.
        services: factories of the services, in the order of a tick.
        nonvolatile: memory that survives a power cycle.

    Raises:
        ValueError: the node-ID is invalid.

    Attributes:
        dictionary: objects of the slave.
        services: services of the slave, in the order of a tick.
        node_id: active node-ID.
        configured_id: node-ID that was passed to the constructor.
        pending_id: node-ID that takes effect at the next reset (CiA 305).
        state: present NMT state.
        now_us: time of the latest tick.
        due_us: time at which the next service is due.
        accepts: CAN-IDs that the slave receives, for the acceptance filter of a wire. None stands
            for all CAN-IDs, from power-on or a reset until the first tick.
        reconfigured_by: CAN-IDs of the frames that may change `accepts` when handled.
        on_accepts: functions that are called when `accepts` or `reconfigured_by` has changed.
        time_of_day: TIME stamp that was received last, or None before the first one.
        silent_until_us: time before which the slave sends nothing, while LSS switches the bit rate.
        on_state: functions that are called with the old and the new state on each change of the NMT
            state.
        on_sync: functions that are called with the counter of each SYNC, or with 0 if the SYNC has
            no counter.
        on_bit_rate: functions that are called with the bit rate in bit/s that LSS has switched to.
        sync_handlers: functions that are called like `on_sync`, for parts of the slave: RPDOs,
            TPDOs, then the application.
        watch_handlers: functions that are called when a TPDO begins to watch objects, for the
            application.
        horizon: time limits up to which the application may compute ahead. None (no rig) means that
            the application works tick by tick.
        model: name of the model for traces, or empty if the slave has no model.
        boots: function that is called at the end of Initialising. It returns whether the node boots
            or stays in Initialising.
        admits: function that is called before each NMT command. It returns whether the command is
            carried out.
        entered: function that is called like `on_state`, but earlier, for a part of the slave.
    """

    __slots__ = (  # each slave's attributes lie in one place then, for 1,016 of them 5 %
        *("__dict__", "__weakref__", "_asking", "_handlers", "_out", "_powered", "accepts"),
        *("admits", "boots", "configured_id", "dictionary", "due_us", "entered", "horizon"),
        *("model", "node_id", "nonvolatile", "now_us", "on_accepts", "on_bit_rate", "on_state"),
        *("on_sync", "pending_id", "reconfigured_by", "services", "silent_until_us", "state"),
        *("sync_handlers", "time_of_day", "watch_handlers"),
    )

    def __init__(
        self,
        dictionary: Dictionary,
        node_id: int,
        services: tuple[ServiceMaker, ...],
        nonvolatile: Nonvolatile | None = None,
    ) -> None:
        if node_id != UNCONFIGURED and not 1 <= node_id <= 127:
            raise ValueError(f"node-ID {node_id} is not in 1..127 and not {UNCONFIGURED}")
        self.dictionary, self.nonvolatile = dictionary, nonvolatile or Nonvolatile()
        self.configured_id = self.pending_id = node_id
        self.node_id, self.state, self.now_us = node_id, NmtState.INITIALISING, 0
        self.on_state: Listeners[Callable[[NmtState, NmtState], None]] = Listeners()
        self.on_sync: Listeners[Callable[[int], None]] = Listeners()
        self.on_bit_rate: Listeners[Callable[[int], None]] = Listeners()
        self.sync_handlers: list[Callable[[int], None]] = []
        self.watch_handlers: list[Callable[[], None]] = []
        self.boots: Callable[[], bool] = _boots
        self.admits: Callable[[NmtCommand], bool] = _admits
        self.entered: Callable[[NmtState, NmtState], None] | None = None
        self.time_of_day: TimeOfDay | None = None
        self.silent_until_us, self.model = 0, ""
        self.horizon: Horizon | None = None
        self._powered = False
        self._out: Frames = ()  # no list: one that stays keeps the garbage collector busy, 4 %
        self._handlers: dict[int, Handler]
        self.accepts: frozenset[int] | None = None
        self.reconfigured_by: frozenset[int] = frozenset()
        self.on_accepts: list[Callable[[], None]] = []
        self._asking: tuple[Service, ...] = ()  # those that have ever asked for a tick, in order
        self.due_us: int = 0
        self.services: list[Service] = [make(self, slot) for slot, make in enumerate(services)]

    @property
    def tick_us(self) -> int:
        """The control period."""
        return TICK_US

    def reset(self) -> None:
        """Lose power; the next tick is the first tick after power-on."""
        self._powered = False
        self.due_us = 0
        self._listen_to(None)

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Run one tick of the slave: handle received frames, do the work that is due, send frames.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: frames that have arrived since the latest tick.

        Returns:
            The frames that the slave sends in this tick.
        """
        self.now_us = now_us
        if not self._powered:
            self._power_on()
            rx = ()  # it was off, or initialised, when these came
        for frame in rx:
            # Places, not names: [2] remote, [3] extended, [0] CAN-ID. One look-up for each
            # frame.
            if frame[2] or frame[3]:
                self._receive_special(frame)
            elif (handler := self._handlers.get(frame[0])) is not None:
                handler(frame)
        if self.due_us <= now_us:
            self._run_due(now_us)
        out = self._out
        if not out:
            return ()
        self._out = ()
        # While LSS switches the bit rate the node sends nothing. Frames of this time are dropped,
        # not delayed.
        if now_us < self.silent_until_us:
            return ()
        return out if len(out) == 1 else tuple(sorted(out, key=_priority))

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame in this tick.

        Args:
            can_id: CAN-ID of 11 bits, 0x000..0x7FF.
            data: data of 0 to 8 bytes.
        """
        self.put(data_frame(can_id, data))

    def put(self, frame: CanFrame) -> None:
        """Send an existing frame in this tick.

        Args:
            frame: data frame to send.
        """
        out = self._out  # mostly there is none; `+=` takes four times as long, 1 % of a network
        self._out = (*out, frame) if out else (frame,)

    def emergency(self, code: int, register: int, text: bytes = b"") -> None:
        """Raise an error of the device, which is sent by EMCY and is active until it is cleared.

        Raising an active error again has no effect.

        Args:
            code: emergency error code; see `EmcyCode`.
            register: bits of the error register 1001h. The generic bit is set automatically.
            text: manufacturer-specific bytes, up to 5. Errors with the same code may differ in
                these bytes.
        """
        if self._powered:
            for service in self.services:
                service.emergency(code, register, text)

    def emergency_clear(self, code: int, text: bytes | None = None) -> None:
        """Clear an error that was raised by `emergency`; do nothing if it is not active.

        Args:
            code: emergency error code, as it was raised.
            text: manufacturer-specific bytes with which the error was raised, or None to clear all
                errors with this code.
        """
        for service in self.services:
            service.emergency_clear(code, text)

    def communication_error(self) -> None:
        """Apply the error behaviour for communication errors (1029h:01)."""
        for service in self.services:
            service.communication_error()

    def bus_state(self, state: ErrorState) -> None:
        """Notify all services of a new error state of the CAN controller, such as bus-off.

        The emulated bus calls this method, because the controller is outside the slave.

        Args:
            state: new state: error active, error passive or bus-off.
        """
        if self._powered:
            for service in self.services:
                service.bus_state(state)

    def overrun(self) -> None:
        """Report that the CAN controller has lost frames.

        The error 8110h is raised by an EMCY and cleared immediately afterwards.
        """
        self.emergency(EmcyCode.CAN_OVERRUN, ErrorRegister.COMMUNICATION)
        self.emergency_clear(EmcyCode.CAN_OVERRUN)

    def schedule(self, slot: int, due_us: int) -> None:
        """Request one call of the method `tick` of a service.

        Args:
            slot: index of the service in the list `services`.
            due_us: time of the call, or `NEVER` for no call.
        """
        self.await_tick(self.services[slot], due_us)

    def await_tick(self, service: Service, due_us: int) -> None:
        """Request one call of the `tick` of a service. This replaces its earlier request.

        `schedule` does the same for a service that is chosen by its slot.

        Args:
            service: service of the slave.
            due_us: time of the call, or `NEVER` for no call.
        """
        before, service.asked_us = service.asked_us, due_us
        if due_us < NEVER and not service._asks:
            service._asks = True
            self._asking = tuple(sorted((*self._asking, service), key=_slot))
        if due_us < self.due_us:
            self.due_us = due_us
        # Only if this service was the earliest is there something to compute again.
        elif before == self.due_us and self._powered:
            self.due_us = self._first_due()

    def rewire(self) -> None:
        """Ask all services again which CAN-IDs they receive, and with which handlers.

        This is needed after a COB-ID or the NMT state has changed.
        """
        services, state = self.services, self.state
        self._handlers = handlers = _frame_handlers(services, state)
        found = (can_id for service in services for can_id in service.reconfigured_by(state))
        self.reconfigured_by = _shared(frozenset(found))
        self._listen_to(frozenset(key & ~_REMOTE for key in handlers))

    def _listen_to(self, accepts: frozenset[int] | None) -> None:
        self.accepts = accepts
        for notify in self.on_accepts:
            notify()

    def enter(self, state: NmtState) -> None:
        """Change the NMT state, and notify the services and the application.

        Args:
            state: new state. If it is the present state, nothing happens.
        """
        old, self.state = self.state, state
        if old is state:
            return
        self.rewire()
        for service in self.services:
            service.state_changed(old, state)
        if self.entered is not None:
            self.entered(old, state)
        for notify in self.on_state:
            notify(old, state)

    def reset_node(self) -> None:
        """Reset application and communication: restore the power-on values of all objects."""
        self._reset(range(0x1_0000))

    def reset_communication(self) -> None:
        """Reset the communication objects, 1000h to 1FFFh, and boot again."""
        self._reset(COMMUNICATION_AREA)

    def _power_on(self) -> None:
        self._powered = True
        self._out = ()
        self.pending_id = self.nonvolatile.node_id or self.configured_id
        self.time_of_day, self.silent_until_us = None, 0
        for service in self.services:
            service.power_on()
        self.reset_node()

    def _reset(self, area: range) -> None:
        self.node_id = self.pending_id
        stored = self.nonvolatile.parameters
        for entry in self.dictionary:
            description = entry.description  # its own properties take as long as all else here
            if description.index in area:
                data = stored.get(description.key)
                if data is None:
                    data = (
                        description.power_on_data(self.node_id)
                        if description.relative
                        else description.default
                    )
                # `assign`, not `force`: it was not written over the bus, so `written`
                # does not act.
                entry.assign(data)
        self._boot()

    def _boot(self) -> None:
        """Pass through Initialising; a slave without a node-ID stays there, with LSS only."""
        self.enter(NmtState.INITIALISING)
        for slot, service in enumerate(self.services):
            self.schedule(slot, NEVER)
            service.start()
        self.rewire()
        if self.node_id != UNCONFIGURED:
            for service in self.services:
                service.booted()

    def _receive_special(self, frame: CanFrame) -> None:
        """Handle a remote frame; 29-bit frames are ignored."""
        handler = self._handlers.get(_REMOTE | frame.can_id)
        if frame.remote and not frame.extended and handler is not None:
            handler(frame)

    def _run_due(self, now_us: int, first: int = 0) -> None:
        """Run the due services in their order; most services have never requested a tick."""
        asking = self._asking
        for service in asking:
            if service.asked_us <= now_us and service.slot >= first:
                service.asked_us = NEVER
                service.tick(now_us)
                if self._asking is not asking:  # one that had never asked may be due behind it
                    self._run_due(now_us, service.slot + 1)
                    return
        if self._powered:
            self.due_us = self._first_due()

    def _first_due(self) -> int:
        """Return the time of the first due service, among services that have requested a tick."""
        first_us = NEVER
        for service in self._asking:
            first_us = min(first_us, service.asked_us)
        return first_us


def _boots() -> bool:
    """Boot as in CiA 301."""
    return True


def _admits(command: NmtCommand) -> bool:
    """Execute each command as in CiA 301."""
    return True


# The application of a device, at its place in the tick.


@mypyc_attr(allow_interpreted_subclasses=True)
class Application(Service):
    """Base class of what a device does besides communication, such as a device profile.

    In each tick it acts after the RPDOs and SDOs have written the objects, and before the TPDOs are
    sent. The base class does nothing. A device profile overrides `on_execute`, which is called in
    these ticks:

    - ticks requested by `request` or `schedule`
    - when one of its watched objects has changed
    - when a physical input was set

    The application can also react to NMT states (`state_changed`), to resets (`start`) and to lost
    masters (`communication_error`), and to each SYNC if it adds itself to `node.sync_handlers`. It
    reports errors by `node.emergency`.

    Attributes:
        inputs: physical inputs of the device, which `has_inputs` makes.
        outputs: physical outputs of the device, whose values `read` returns.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.inputs = QuantityBank()
        self.outputs: Mapping[str, OutputSignal] = {}

    def has_inputs(
        self, table: Iterable[InputSignal], groups: Mapping[str, tuple[str, ...]] | None = None
    ) -> None:
        """Define the physical inputs of the device. Setting an input requests `on_execute`.

        Args:
            table: descriptions of the inputs.
            groups: names of inputs that are set together, by name of the group.
        """
        self.inputs = QuantityBank(table, groups, self.request)

    def read(self, name: str) -> int | float | str:
        """Return the present value of a physical output.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The present value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        raise KeyError(name)

    def on_execute(self, now_us: int) -> None:
        """Read inputs and objects, do the work of the device, and write outputs and objects.

        A device profile overrides this method.

        Args:
            now_us: time of the tick.
        """

    def without_power(self, now_us: int) -> int:
        """Simulate the device while it has no supply, for example the motor as it coasts.

        The method is called in the first tick without power, and after a physical input was set. It
        is also called at the time that the latest call has returned.

        Args:
            now_us: time of the tick.

        Returns:
            The time of the next call, or `NEVER` if the state changes only by a physical input.
        """
        return NEVER

    def request(self) -> None:
        """Request `on_execute` in this tick, or between two ticks in the next tick."""
        self.schedule(self.node.now_us)

    def watch(self, entries: Iterable[Entry]) -> None:
        """Watch objects: a change of one of them requests a call of `on_execute`.

        Args:
            entries: objects to watch.
        """
        changed = self._object_changed
        for entry in entries:
            entry.watch(changed)

    def _object_changed(self, entry: Entry) -> None:
        self.request()

    def tick(self, now_us: int) -> None:
        """Run `on_execute`."""
        self.on_execute(now_us)


def number_of(entry: Entry | None, default: int) -> int:
    """Return the value of an entry as a number, or the default if the entry is None.

    None means that the device does not have the object.
    """
    return default if entry is None else entry.number
