"""What `RrcClient` believes of its RRC is so: every command at every 1 ms around every transition.

`python -m tests.properties.test_rrc_belief` plays all of them; the suite plays a part.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice, product
from typing import Final, NamedTuple

from tickrig.device.rrc.config import FailTarget, RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.states import POWERED_ON, RrcState
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.errors import LinkTimeout
from tickrig.host.rrc import RrcClient, RrcRefused
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import commands as cmd

MS: Final = 1_000
AROUND_MS: Final = 40
AFTER_MS: Final = 120
"""By then the client has given up waiting for an ER, and the RRC has worked on all lines."""

COMMANDS: Final = (
    *(cmd.Limit(50, 50), cmd.Output(30, 0), cmd.DeviceName(), cmd.Version(), cmd.Date()),
    *(cmd.SpeedMode(4, 1), cmd.Joystick(reverse_mode=3), cmd.Watchdog(50), cmd.Watchdog(0)),
    *(cmd.StableMode(1), cmd.StableMode(0), cmd.Status(1), cmd.PowerOff(), cmd.Beep((1,) * 10)),
)
CHOOSES: Final = {RrcState.LIMIT: cmd.Limit, RrcState.OUTPUT: cmd.Output}
TO_ENTER: Final = {RrcState.LIMIT: cmd.Limit(100, 100), RrcState.OUTPUT: cmd.Output(0, 0)}


class Act(NamedTuple):
    """A physical input that changes."""

    at_ms: int
    name: str
    value: int


@dataclass(frozen=True, slots=True)
class Story:
    """What happens to an RRC that is in some state.

    Attributes:
        begin: that state.
        acts: the inputs that change, in order.
        cut: whether the RRC loses its power, and with it lines that it has answered to nobody.
    """

    begin: RrcState
    acts: tuple[Act, ...]
    config: RrcConfig = field(default_factory=RrcConfig)
    cut: bool = False


def button(at_ms: int) -> tuple[Act, Act]:
    return Act(at_ms, "power_button", 1), Act(at_ms + 30, "power_button", 0)


def pulse(name: str, value: int, from_ms: int, to_ms: int) -> tuple[Act, Act]:
    return Act(from_ms, name, value), Act(to_ms, name, 1 - min(value, 1))


OFF_AND_ON: Final = pulse("rrc_power", 0, 50, 133)
NO_BUS: Final = (*pulse("bus_unplugged", 1, 50, 200), *button(250))
NO_TIME: Final = (*pulse("extra_load_pct", 1_000, 50, 60), *button(150))
NO_SUCCESS: Final = (Act(40, "bus_noise", 1), *button(50), Act(390, "bus_noise", 0))
AGAIN: Final = RrcConfig(power_on_fail_target=FailTarget.INITIALIZE)
STORIES: Final = {
    "power-on": Story(RrcState.WAIT_POWER_ON, button(50)),
    "power-on fails": Story(RrcState.WAIT_POWER_ON, NO_SUCCESS),
    "power-on fails, all again": Story(RrcState.WAIT_POWER_ON, NO_SUCCESS, AGAIN),
    "RRC without power": Story(RrcState.WAIT_POWER_ON, OFF_AND_ON, cut=True),
    "RRC without power, VR2 on": Story(RrcState.LIMIT, OFF_AND_ON, cut=True),
    "long Initialize": Story(RrcState.STANDBY, button(50), RrcConfig(initialize_ticks=5)),
    **{f"{state.value}, button": Story(state, button(50)) for state in POWERED_ON},
    **{f"{state.value}, fault": Story(state, NO_BUS) for state in POWERED_ON},
    "over time": Story(RrcState.OUTPUT, NO_TIME),
}


class Talk(NamedTuple):
    """How the client talks.

    Attributes:
        stable: stablemode is on when the story begins.
        watched: a watchdog runs that the client must renew.
        asleep: the client does not listen before its command.
        confirm: it waits for the answer to its command.
    """

    stable: bool
    watched: bool
    asleep: bool
    confirm: bool


class Stage:
    """An RRC to which a story happens, and its client; a `Link[bytes]` between them."""

    def __init__(self, story: Story) -> None:
        self.rrc, self.line = Rrc(story.config), SerialLine()
        self.rig = Rig(Station(self.rrc, self.line.a))
        self._link = SimLink(self.rig, self.line.b)
        self._acts: list[tuple[int, Act]] = []
        self.client = RrcClient(self)

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        until_us = self.now_us + timeout_us
        while True:
            data = self._link.receive(self._act(until_us) - self.now_us)
            if data or self.now_us >= until_us:
                return data

    def close(self) -> None:
        """Nothing to close."""

    def begin(self, story: Story, talk: Talk) -> None:
        self.client.start()
        if story.begin is not RrcState.WAIT_POWER_ON:
            self.rrc.inputs.set("power_button", 1)
            self.client.run_for(40 * MS)
            self.rrc.inputs.set("power_button", 0)
            self.client.run_for(300 * MS)
        if command := TO_ENTER.get(story.begin):
            self.client.command(command)
        if talk.watched:
            self.client.watchdog(100 * MS)
        if talk.stable:
            self.client.stablemode()
        self.client.run_for(2 * AFTER_MS * MS - self.now_us % (20 * MS))
        assert self.rrc.state is story.begin
        self._acts = [(self.now_us + act.at_ms * MS, act) for act in story.acts]

    def sleep(self, until_us: int) -> None:
        """Let time pass while the client does not listen."""
        while self.now_us < until_us:
            self.rig.run_to(self._act(until_us))

    def _act(self, until_us: int) -> int:
        """Do what is due; return when the next act is, at most `until_us`."""
        while self._acts and self._acts[0][0] <= self.now_us:
            _, act = self._acts.pop(0)
            self.rrc.inputs.set(act.name, act.value)
        return min(until_us, self._acts[0][0]) if self._acts else until_us

    @property
    def quiet(self) -> bool:
        """Whether all that was sent was worked on, and all that was answered was read."""
        waiting = self.rrc._buffer
        return not waiting and self.line.a.idle_us == self.line.b.idle_us == NEVER

    def check_belief(self) -> None:
        """Compare; not before EV:Initialized, which tells that the RRC was off or starts again."""
        if not self.quiet or self.rrc.state in (RrcState.OFF, RrcState.INITIALIZE):
            return
        truth, belief = self.rrc._settings, self.client._settings
        assert belief.stable == truth.stable, "stablemode"
        assert belief.watchdog_10ms == truth.watchdog_ticks, "watchdog"
        assert belief.locked == truth.speed_locked, "lock"
        if self.rrc.state in POWERED_ON:
            assert belief.drive in (None, CHOOSES.get(self.rrc.state)), "drive"


def transitions_ms(story: Story) -> list[int]:
    """Return when the state changes, from the beginning of the story on."""
    stage = Stage(story)
    stage.begin(story, Talk(stable=False, watched=False, asleep=False, confirm=True))
    start_us, state, found = stage.now_us, stage.rrc.state, []
    while stage.now_us < start_us + 1_000 * MS:
        stage.client.run_for(10 * MS)
        if stage.rrc.state is not state:
            state = stage.rrc.state
            found.append((stage.now_us - start_us) // MS)
    return found


def phases_ms(story: Story) -> list[int]:
    """Return every millisecond around every transition."""
    around = [range(at - AROUND_MS, at + AROUND_MS + 1) for at in transitions_ms(story)]
    return sorted({phase for phases in around for phase in phases if phase >= 0})


def play(story: Story, command: cmd.Command, talk: Talk, at_ms: int) -> None:
    """Play a story and compare whenever nothing is on its way."""
    stage = Stage(story)
    stage.begin(story, talk)
    client, start_us = stage.client, stage.now_us
    if talk.asleep:
        stage.sleep(start_us + at_ms * MS)
    else:
        listen(stage, start_us + at_ms * MS)
    with suppress(RrcRefused, *([LinkTimeout] if story.cut else [])):
        client.command(command, confirm=talk.confirm)
    listen(stage, max(stage.now_us + AFTER_MS * MS, start_us + 800 * MS))
    while not stage.quiet:
        listen(stage, stage.now_us + 3 * MS)
    with suppress(RrcRefused):
        assert client.version() == "Version 1.0"
    assert client.version() == "Version 1.0"


def listen(stage: Stage, until_us: int) -> None:
    while stage.now_us < until_us:
        stage.client.run_for(min(10 * MS, until_us - stage.now_us))
        stage.check_belief()


def plays() -> Iterator[tuple[str, cmd.Command, Talk, int]]:
    """Give all there is to play."""
    talks = [Talk(*flags) for flags in product((False, True), repeat=4)]
    for name, story in STORIES.items():
        for command, talk, at_ms in product(COMMANDS, talks, phases_ms(story)):
            yield name, command, talk, at_ms


def failures(chosen: Iterable[tuple[str, cmd.Command, Talk, int]]) -> Iterator[str]:
    for name, command, talk, at_ms in chosen:
        try:
            play(STORIES[name], command, talk, at_ms)
        except Exception as error:
            kind = f"{type(error).__name__} {str(error).splitlines()[0] if str(error) else ''}"
            yield f"{name}; {command}; {talk}; at {at_ms} ms: {kind}"


def test_the_client_believes_what_is_so() -> None:
    assert list(failures(islice(plays(), 0, None, 997))) == []


if __name__ == "__main__":
    every = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    count = 0
    for failure in failures(islice(plays(), 0, None, every)):
        print(failure)
        count += 1
    print(f"{count} failures")
    sys.exit(count > 0)
