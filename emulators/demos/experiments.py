"""The experiments of the RSi2/NEDO report with several robots: follow, leader, four, joystick."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from typing import Final, NamedTuple

from tickrig.emulators.demos.tracks import LOOK_US, Mark, RobotSample, RobotTrack, advanced
from tickrig.emulators.rh3.convoy import Convoy, MovingControl
from tickrig.host.control.clock import RealClock
from tickrig.host.links.game_pad import StickPosition
from tickrig.host.rtc.motion.drive import PERIOD_US
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.iis_interfaces import Velocity2To1, Velocity3To2
from tickrig.host.rtc.motion.options.game_pad import GamePad

# Theory of operation
# ===================
#
# An experiment is a table: the first poses of the robots, the leader of each follower, the motions
# of the sticks, and the changes of connectors with their times. `ConvoyRun` makes the components:
#
#     PadA -> JoystickA -> MovingControl0 -> RefHardRh30    a robot that a stick drives
#     Odometry0 -> Follower1 -> RefHardRh31                 a robot that follows another
#
# `JoystickA` and `MovingControl0` use the interface of the report's phase: RTC::TimedVelocity
# (phase 1, Fig. 90) or IIS::TimedVelocity (phase 2, Fig. 94). Any joystick can be connected to any
# robot (Fig. 91), and any pose to any follower (Fig. 98).
#
# In virtual time the acts of the table change the connectors like `tickrig rtc con` and `dis`. In
# real time (`terminal_cli`) the experiment does not change connectors: `tickrig rtc --at` or a
# tool of OpenRTM changes them. In both cases the planned path of a robot follows from the present
# connectors. It is the path of the robot that is followed, or the path that the command of the
# stick describes.

_SECOND_US: Final = 1_000_000
_ROW_US: Final = 2 * _SECOND_US
_RATE_HZ: Final = 50.0
_PATIENT: Final = "3600"
"""Time-out in seconds; until then a follower goes to the last pose of a silent leader and waits."""

_Echo = Callable[[str], None]


class _Push(NamedTuple):
    """Position of a stick for some time; 1.0 is the end of its travel."""

    duration_s: float
    forward: float = 0.0
    turn: float = 0.0
    left: float = 0.0


class _Act(NamedTuple):
    """A change of connectors while all robots move.

    Attributes:
        at_s: time of the change, in s.
        text: description as readable text.
        steps: words of `tickrig rtc`, in which `{pose0}`, `{base0}` are ports of robot 0.
    """

    at_s: float
    text: str
    steps: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment with several robots.

    Attributes:
        title: title of the picture.
        robots: names and first poses of the robots on two wheels, in the order of the numbers in
            port names.
        omni: name and first pose of the robot on omni wheels, which has the next number.
        sticks: motions of each joystick, which are repeated.
        driven: joysticks at the start, by name of the robot that each of them drives.
        followed: leaders at the start, by name of the follower.
        acts: the changes. The last change ends the experiment.
        phase: phase of the common interface between joysticks and robots.
        controlled: robots that a joystick can be connected to. The default is all robots in
            `driven`.
    """

    title: str
    robots: Mapping[str, Pose]
    omni: Mapping[str, Pose]
    sticks: Mapping[str, tuple[_Push, ...]]
    driven: Mapping[int, str]
    followed: Mapping[int, int] = field(default_factory=dict)
    acts: tuple[_Act, ...] = ()
    phase: int = 2
    controlled: tuple[int, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all robots, by number."""
        return (*self.robots, *self.omni)


_ROUND: Final = (_Push(7, 1.0), _Push(5.2, 1.0, 1.0))
"""Motion along a square with round corners."""

FOLLOW: Final = Experiment(
    "Experiment A: two robots follow a preceding one (Fig. 96)",
    {"Ref-Hard": Pose(), "Segway RMP": Pose(-1.0, 0.5)},
    {"Omni-Wheel": Pose(-2.0, -0.5)},
    {"A": _ROUND},
    {0: "A"},
    {1: 0, 2: 1},
    (_Act(0, "Segway RMP follows Ref-Hard, Omni-Wheel follows Segway RMP"), _Act(44, "")),
)

LEADER: Final = Experiment(
    "Experiment B1: leaders are exchanged while all robots move (Figs. 98, 99)",
    {"Ref-Hard": Pose(-1.2, 1.5), "Segway RMP": Pose(0.0, 0.0), "BlackShip": Pose(-1.2, 0.0)},
    {"Omni-Wheel": Pose(0.0, 1.5)},
    {"A": _ROUND, "B": _ROUND},
    {3: "A", 1: "B"},
    {0: 3, 2: 1},
    (
        _Act(0, "(a) Ref-Hard follows Omni-Wheel, BlackShip follows Segway RMP"),
        _Act(
            12,
            "following exchange 1: (b) Ref-Hard follows Segway RMP, BlackShip Omni-Wheel",
            (
                "dis {pose3} Follower0.leader",
                "con {pose1} Follower0.leader",
                "dis {pose1} Follower2.leader",
                "con {pose3} Follower2.leader",
            ),
        ),
        _Act(
            26,
            "following exchange 2: (a) again",
            (
                "dis {pose1} Follower0.leader",
                "con {pose3} Follower0.leader",
                "dis {pose3} Follower2.leader",
                "con {pose1} Follower2.leader",
            ),
        ),
        _Act(
            38,
            "removal: Ref-Hard has nothing to follow, and waits",
            ("dis {pose3} Follower0.leader",),
        ),
        _Act(44, "joining again: Ref-Hard follows Omni-Wheel", ("con {pose3} Follower0.leader",)),
        _Act(58, ""),
    ),
)

FOUR: Final = Experiment(
    "Experiment B2: four robots on one command (Figs. 91, 101)",
    {"Ref-Hard": Pose(-1.2, 1.0), "Segway RMP": Pose(0.0, 0.0), "BlackShip": Pose(-1.2, -1.0)},
    {"Omni-Wheel": Pose(0.0, 2.0)},
    {"A": _ROUND, "B": (_Push(7, 1.0), _Push(5.2, 1.0, -1.0))},
    {3: "A", 1: "B"},
    {0: 3, 2: 1},
    (
        _Act(0, "as B1 ends: two robots follow, two obey a joystick each"),
        _Act(
            8,
            "removal: no robot has a command; all stop, and the system runs on",
            (
                "dis {pose3} Follower0.leader",
                "dis {pose1} Follower2.leader",
                "dis JoystickA.out MovingControl3.in",
                "dis JoystickB.out MovingControl1.in",
            ),
        ),
        _Act(
            13,
            "one joystick, four robots",
            (
                "dis Follower0.velocity {base0}",
                "dis Follower2.velocity {base2}",
                *(f"con JoystickA.out MovingControl{n}.in" for n in range(4)),
            ),
        ),
        _Act(
            34,
            "any joystick, any robot (Fig. 91): B takes Ref-Hard and BlackShip",
            tuple(
                step
                for n in (0, 2)
                for step in (
                    f"dis JoystickA.out MovingControl{n}.in",
                    f"con JoystickB.out MovingControl{n}.in",
                )
            ),
        ),
        _Act(52, ""),
    ),
    controlled=(0, 1, 2, 3),
)

JOYSTICK: Final = Experiment(
    "Phase 1: one joystick drives two robots (Fig. 92)",
    {"Ref-Hard": Pose()},
    {"Omni-Wheel": Pose(0.0, 1.0)},
    {"A": (_Push(6, 1.0), _Push(5, 0.5, 1.0), _Push(4, 1.0), _Push(8, 0.5, -1.0), _Push(4, 1.0))},
    {0: "A", 1: "A"},
    acts=(_Act(0, "forward, a left turn, forward, a right turn (Fig. 93)"), _Act(28, "")),
    phase=1,
)


class _Program:
    """A simulated hand that pushes a stick according to a table, repeatedly."""

    def __init__(self, pushes: tuple[_Push, ...]) -> None:
        self._pushes, self._ends_s = pushes, list(accumulate(push.duration_s for push in pushes))

    def poll(self, now_us: int, /) -> StickPosition:
        """Return the position of the stick."""
        at_s = now_us / _SECOND_US % self._ends_s[-1]
        push = next(
            push for push, end_s in zip(self._pushes, self._ends_s, strict=True) if at_s < end_s
        )
        return StickPosition(push.forward, push.left, push.turn)

    def close(self) -> None:
        """Do nothing, because nothing is open."""


class ConvoyRun:
    """A run of a demonstration in which robots follow one another, with their recorded motions.

    Args:
        experiment: description of the experiment: its robots, and the changes that are planned for
            the run (`Experiment.acts`).
        echo: function that prints a line of text. Every 2 s it gets a line with the positions of
            the robots.
        clock: clock of a run in real time, or None for a run in virtual time.

    Attributes:
        convoy: the robots and their components.
        tracks: tracks of the robots, in the order of their numbers.
        marks: changes during the run up to now. Most changes connect or disconnect ports of
            components. The picture marks each change with a number.
    """

    def __init__(self, experiment: Experiment, echo: _Echo, clock: RealClock | None = None) -> None:
        self._experiment, self._echo = experiment, echo
        self.convoy = convoy = Convoy(
            [*experiment.robots.values()], [*experiment.omni.values()], clock
        )
        self._played = clock is None
        self.tracks = [RobotTrack(name) for name in experiment.names]
        self.marks: list[Mark] = []
        self._controls: dict[int, MovingControl] = {}
        self._planned: list[Pose | None] = [None] * len(self.tracks)
        self._leader_of: dict[int, int] = {}
        self._connected: frozenset[tuple[str, ...]] | None = None
        self._leaders = {robot.position: number for number, robot in enumerate(convoy.robots)}
        self._join()
        convoy.loop.activate()

    @property
    def ports(self) -> dict[str, str]:
        """Ports of the robots: `pose0`, `base0` and so on."""
        robots = tuple(enumerate(self.convoy.robots))
        return {f"pose{n}": it.position for n, it in robots} | {
            f"base{n}": it.velocity for n, it in robots
        }

    def begin(self) -> None:
        """Print the header of the table, and the positions of the robots."""
        self._echo(f"  time s{''.join(f'{name:>16}' for name in self._experiment.names)}")
        self.look(0)

    def play(self) -> None:
        """Play the acts in virtual time."""
        self.begin()
        loop = self.convoy.loop
        acts = self._experiment.acts
        for act, until in pairwise(acts):
            self.change(act)
            while loop.now_us < until.at_s * _SECOND_US:
                loop.run_to(loop.now_us + PERIOD_US)
                self.look(loop.now_us)

    def change(self, act: _Act) -> None:
        """Change connectors, and print the commands that do the same."""
        self._echo(f"\n{act.at_s:8.1f}  {act.text}")
        for step in act.steps:
            words = step.format_map(self.ports)
            verb, first, second = words.split()
            self._echo(f"          $ tickrig rtc {words}")
            join = self.convoy.loop.manager
            (join.connect if verb == "con" else join.disconnect)(first, second)
        if act.at_s:
            self.marks.append(Mark(act.at_s, act.text))

    def look(self, now_us: int) -> None:
        """Record the positions of the robots, and the changes of connectors by other programs."""
        poses = [robot.true_pose for robot in self.convoy.robots]
        leaders = dict(self._followed())
        for number, control in self._controls.items():
            self._planned[number] = (
                None
                if control.twist is None
                else advanced(
                    self._planned[number] or poses[number], control.twist, PERIOD_US / _SECOND_US
                )
            )
        if now_us % LOOK_US == 0:
            for number, track in enumerate(self.tracks):
                pose, planned, gap_m = poses[number], self._planned[number], None
                if number in leaders:
                    gap_m = pose.distance(poses[leaders[number]])
                    is_new = self._leader_of.get(number) != leaders[number]
                    planned = None if is_new else poses[leaders[number]]  # no line to the new one
                track.looks.append(RobotSample(now_us / _SECOND_US, pose, planned, gap_m))
            self._leader_of = leaders
            self._note_connectors(now_us / _SECOND_US)
        if now_us % _ROW_US == 0:
            places = "".join(f"{pose.x:9.2f}{pose.y:7.2f}" for pose in poses)
            self._echo(f"{now_us / _SECOND_US:8.1f}{places}")

    def _note_connectors(self, now_s: float) -> None:
        """Make a mark if the connectors have changed since the previous sample."""
        connected = frozenset(it.ports for it in self.convoy.loop.manager.connectors)
        before, self._connected = self._connected, connected
        if before is None or before == connected or self._played:
            return
        changes = [f"con {' '.join(ports)}" for ports in sorted(connected - before)]
        changes += [f"dis {' '.join(ports)}" for ports in sorted(before - connected)]
        self.marks.append(Mark(now_s, ", ".join(changes)))
        self._echo(f"\n{now_s:8.1f}  {', '.join(changes)}")

    def _followed(self) -> Iterator[tuple[int, int]]:
        """Yield the followers and leaders that are connected now."""
        for number in self._experiment.followed:
            port = self.convoy.loop.manager.port(f"Follower{number}.leader")
            for connector in port.connectors:
                for name in connector.profile.ports:
                    if name in self._leaders:
                        yield number, self._leaders[name]

    def _join(self) -> None:
        convoy, experiment = self.convoy, self._experiment
        manager = convoy.loop.manager
        manager.disconnect("PathFollower0.velocity", convoy.robots[0].velocity)
        for letter, pushes in experiment.sticks.items():
            self._add_stick(letter, _Program(pushes))
        for number in experiment.controlled or tuple(experiment.driven):
            control = MovingControl(f"MovingControl{number}", experiment.phase)
            self._controls[number] = manager.add(control, rate_hz=_RATE_HZ)
            manager.connect(f"MovingControl{number}.out", convoy.robots[number].velocity)
            manager.activate(control.instance_name)
        for number, letter in experiment.driven.items():
            manager.connect(f"Joystick{letter}.out", f"MovingControl{number}.in")
        for number, leader in experiment.followed.items():
            convoy.follow(number, leader)
            follower = manager.find(f"Follower{number}")
            follower.configuration.set("pose_timeout", _PATIENT)

    def _add_stick(self, letter: str, program: _Program) -> None:
        """Add a joystick whose OutPort has the type of the experiment's phase."""
        manager, source = self.convoy.loop.manager, f"Pad{letter}.velocity"
        names = [f"Pad{letter}", f"Joystick{letter}"]
        manager.add(GamePad(names[0], lambda name: program), rate_hz=_RATE_HZ)
        if self._experiment.phase == 1:
            names.insert(1, f"Pad{letter}2")
            manager.add(Velocity3To2(names[1]), rate_hz=_RATE_HZ)
            manager.add(Velocity2To1(names[2]), rate_hz=_RATE_HZ)
        else:
            manager.add(Velocity3To2(names[1]), rate_hz=_RATE_HZ)
        for name in names[1:]:
            manager.connect(source, f"{name}.in")
            source = f"{name}.out"
        manager.activate(*names)
