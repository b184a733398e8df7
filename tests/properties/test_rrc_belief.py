"""RRC, client and operator panel agree: every command at every 1 ms around every transition.

What `RrcClient` believes is so, what it confirmed holds, the panel shows what is so, and neither a
command nor a stream of them at the client's pace is too much for the RRC.
`python -m tests.properties.test_rrc_belief` plays all of them; the suite plays a part.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, islice, product
from typing import Final, NamedTuple

from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import POWERED_ON, FailTarget, RrcConfig, RrcState
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rrc.panel_text import Observer, stick_hint
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import VERSION, Object
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import RrcClient, RrcRefused, RrcStopped
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.replies import RrcEvent

MS: Final = 1_000
AROUND_MS: Final = 40
AFTER_MS: Final = 120
"""By then the client has given up waiting for an ER, and the RRC has worked on all lines."""

IGNORED: Final = cmd.Joystick(neutral_pct=255, switch_deg=20, fade_deg=91)
TAKEN: Final = cmd.Joystick(neutral_pct=5, switch_deg=20, fade_deg=45)
"""What the RRC takes of `IGNORED`: with #7 at 0, values out of range leave the former ones."""

COMMANDS: Final = (
    *(cmd.Limit(50, 50), cmd.Output(30, 0), cmd.DeviceName(), cmd.Version(), cmd.Date()),
    *(cmd.SpeedMode(4, 1), cmd.Joystick(reverse_mode=3), cmd.Watchdog(50), cmd.Watchdog(0)),
    *(cmd.StableMode(1), cmd.StableMode(0), cmd.Status(1), cmd.Status(0)),
    *(cmd.PowerOff(), cmd.Beep((1,) * 10), IGNORED),
)
SHOWN_MS: Final = 100
"""So long the panel shows the latest status line, at most."""

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
        busy: whether the RRC has other work, so that it stops by itself.
    """

    begin: RrcState
    acts: tuple[Act, ...]
    config: RrcConfig = field(default_factory=RrcConfig)
    cut: bool = False
    busy: bool = False


def button(at_ms: int) -> tuple[Act, Act]:
    return Act(at_ms, "power_button", 1), Act(at_ms + 30, "power_button", 0)


def pulse(name: str, value: int, from_ms: int, to_ms: int) -> tuple[Act, Act]:
    return Act(from_ms, name, value), Act(to_ms, name, 1 - min(value, 1))


OFF_AND_ON: Final = pulse("rrc_power", 0, 50, 133)
NO_BUS: Final = (*pulse("bus_unplugged", 1, 50, 200), *button(250))
ON_AGAIN: Final = (*pulse("bus_unplugged", 1, 50, 180), *button(200), *button(320))
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
    "off, and on again": Story(RrcState.OUTPUT, ON_AGAIN),
    "over time": Story(RrcState.OUTPUT, NO_TIME, busy=True),
}


class Talk(NamedTuple):
    """How the client talks.

    Attributes:
        stable: stablemode is on when the story begins.
        watched: a watchdog runs that the client must renew, and status lines come.
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
        self.story, self.rrc = story, Rrc(story.config)
        emulator = Emulator("rrc", self.rrc)
        self.rig, self.line = emulator.rig, emulator.line
        self._link, self._control = SimLink(self.rig, emulator.host_end), EmulatorControl(emulator)
        self._panel = Observer()
        self._acts: list[tuple[int, Act]] = []
        self._confirmed: tuple[int, cmd.Command] | None = None
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
            self.client.status()
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
        self._check_confirmed()
        self._check_panel()
        self._check_load()

    def confirmed(self, command: cmd.Command) -> None:
        """Note a command that the client says the RRC carried out."""
        self._confirmed = (self.now_us, command)

    def heard(self, kind: RrcEvent, since_us: int = 0) -> bool:
        """Whether the client heard an event, and took it from nobody."""
        events = self.client._inbox.events
        return any(event.value.kind is kind and event.at_us >= since_us for event in events)

    def _check_confirmed(self) -> None:
        """What was confirmed holds, unless the client heard that all was wiped since."""
        if self._confirmed is None or self.heard(RrcEvent.INITIALIZED, self._confirmed[0]):
            return
        now = self.rrc._settings
        match self._confirmed[1]:
            case cmd.Joystick() as command:
                assert now.joystick == (TAKEN if command == IGNORED else command), "joystick"
            case cmd.Limit() as command:
                assert now.limit == command, "limit"
            case cmd.Output() as command:
                assert now.output == command, "output"
            case cmd.SpeedMode(mode, locked):
                assert (now.speed_mode, now.speed_locked) == (mode, bool(locked)), "speed mode"
            case cmd.Status(on):
                assert now.status == bool(on), "status"

    def _check_panel(self) -> None:
        look = [self._ask("get"), self._ask("status"), self._ask("lines", since=self._panel.seen)]
        self._panel.take(*look)
        view, rrc, drive = self._panel.view, self.rrc, self.client._settings.drive
        running, hint = rrc.state in POWERED_ON, stick_hint(view)
        assert view.values["state"] == rrc.state.value, "panel: state"
        assert hint.startswith("drives") == bool(rrc.read("stick_drives")), f"panel: {hint}"
        if running and drive is not None:
            said = "the host drives" if drive is cmd.Output else "drives, within limits"
            assert hint == said, f"panel: {hint}, client: {drive.__name__}"
        if running and rrc._settings.status and (latest := self.client.latest_status):
            assert view.decoded == latest.value, "panel: status line"
            assert latest.value.encode() == rrc._status(), "client: status line"
        shown = running and (rrc._settings.status or self._is_fresh)
        assert shown or not view.report, "panel: an old status line"

    @property
    def _is_fresh(self) -> bool:
        latest = self.client.latest_status
        return latest is not None and self.now_us - latest.at_us < SHOWN_MS * MS

    def _check_load(self) -> None:
        view, rrc, load = self._panel.view, self.rrc, self.client.load
        for name in ("load_pct", "margin_pct", "pace_lines_s"):
            assert view.values[name] == rrc.read(name), f"panel: {name}"
        if self.story.busy:
            return
        assert not self.heard(RrcEvent.BY_OVER_TIME), "over time"
        if rrc.state in POWERED_ON:
            assert load.pace_lines_s <= view.number("pace_lines_s"), "pace"
            assert load.pace_lines_s == view.number("pace_lines_s") or not rrc._settings.status
            assert view.number("backlog_pct") < 100, "backlog"

    def _ask(self, do: str, **fields: int) -> Object:
        return self._control.answer({"v": VERSION, "do": do, **fields})


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
        if talk.confirm or isinstance(command, cmd.StableMode):
            stage.confirmed(command)
    listen(stage, max(stage.now_us + AFTER_MS * MS, start_us + 800 * MS))
    while not stage.quiet:
        listen(stage, stage.now_us + 3 * MS)
    with suppress(RrcRefused):
        assert client.version() == "Version 1.0"
    assert client.version() == "Version 1.0"


def stream(story: Story, talk: Talk, at_ms: int) -> None:
    """Play a story while the client sends `output` at its pace, from `at_ms` on."""
    stage = Stage(story)
    stage.begin(story, talk)
    client, start_us = stage.client, stage.now_us
    listen(stage, start_us + at_ms * MS)
    with suppress(RrcStopped):
        while stage.now_us < start_us + 800 * MS:
            client.output(10, 0, confirm=False)
    with suppress(RrcStopped):  # the answers of the last outputs may be what stops it
        listen(stage, start_us + 1_000 * MS)
    if client.stopped:
        client.resume()
    while not stage.quiet:
        listen(stage, stage.now_us + 3 * MS)
    stage.check_belief()


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


def streams() -> Iterator[tuple[str, None, Talk, int]]:
    """Give all streams: they begin at each millisecond of a period."""
    both = (False, True)
    for name, stable, watched, at_ms in product(STORIES, both, both, range(10)):
        yield name, None, Talk(stable, watched, asleep=False, confirm=False), at_ms


def failures(chosen: Iterable[tuple[str, cmd.Command | None, Talk, int]]) -> Iterator[str]:
    for name, command, talk, at_ms in chosen:
        try:
            if command is None:
                stream(STORIES[name], talk, at_ms)
            else:
                play(STORIES[name], command, talk, at_ms)
        except Exception as error:
            kind = f"{type(error).__name__} {str(error).splitlines()[0] if str(error) else ''}"
            yield f"{name}; {command}; {talk}; at {at_ms} ms: {kind}"


def test_rrc_client_and_panel_agree() -> None:
    assert list(failures(islice(plays(), 0, None, 997))) == []


def test_they_agree_after_a_stream_at_the_pace_of_the_client() -> None:
    assert list(failures(islice(streams(), 0, None, 17))) == []


if __name__ == "__main__":
    every = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    count = 0
    for failure in failures(islice(chain(streams(), plays()), 0, None, every)):
        print(failure)
        count += 1
    print(f"{count} failures")
    sys.exit(count > 0)
