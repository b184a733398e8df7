"""One robot at a time: `tickrig demo rh3`, `beego` and `fourx`."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees, radians
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.demos.tracks import LOOK_US, RobotSample, RobotTrack, advanced
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.testing.bench.bench import open_bench
from tickrig.host.rtc.canopen.definition import DeviceFile, SystemDefinition, read_device_file
from tickrig.host.rtc.canopen.definition_reader import read_definition
from tickrig.host.rtc.canopen.robots import Beego, FourX, Joystick, WheeledBase
from tickrig.host.rtc.canopen.serve import serve
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.motion.components.omni_to_2wd import plan
from tickrig.host.rtc.motion.drive import drive, limits_of, start, stop, table
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.motion_run import TrackSample
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.canopen.eds.eds_writer import write_eds

_HERE: Final = Path(__file__).parent
_SECOND_US: Final = 1_000_000
_ROW_US: Final = _SECOND_US

_Echo = Callable[[str], None]


# Reference Hardware 3: a goal, then the path that PositionInput has (RH3 specification, 3.1).

_GOAL: Final = Pose(1.5, 0.5, 1.57)


def drive_rh3(echo: _Echo) -> RobotTrack:
    """Drive a cart to a goal and along a path; print the deviations."""
    loop = ClosedLoop(BaseParameters(noise=0.05, seed=7))
    start(loop)
    track, chain, planned = RobotTrack("RH3"), loop.chain, list[Pose]()

    def watch(sample: TrackSample) -> None:
        if loop.now_us % LOOK_US == 0:
            track.looks.append(RobotSample(loop.now_us / _SECOND_US, sample.pose))

    for text, points in (
        ("PositionInput sends a goal.", [_GOAL]),
        ("PositionInput sends its path.", list(chain.position_input.defined_path)),
    ):
        echo(text)
        for point in points:
            echo(f"  {point.x:6.2f} {point.y:6.2f} m {degrees(point.heading):6.1f} deg")
        began = chain.odometry.pose
        planned += plan(began, points)
        run = drive(loop, points, watch)
        for line in table(run, began, points, limits_of(chain)):
            echo(f"  {line}")
    stop(loop)
    track.corners = planned
    return track


# beego and FourX: a joystick, a base as an RT component, and proxies of what its wheels have.

_WAY: Final = ((0, 0, 1), (60, 0, 4), (40, 50, 4), (60, 0, 2), (0, -100, 2), (60, 0, 2), (0, 0, 1))
"""Positions of the joystick: forward and to the left in %, and duration in seconds."""


def drive_beego(echo: _Echo) -> RobotTrack:
    """Drive beego by its joystick."""
    return _drive_wheels("beego", Beego("Beego0"), echo)


def drive_fourx(echo: _Echo) -> RobotTrack:
    """Drive FourX by its joystick."""
    return _drive_wheels("fourx", FourX("Fourx0"), echo)


def _drive_wheels(name: str, base: WheeledBase, echo: _Echo) -> RobotTrack:
    bench = open_bench(_HERE / f"{name}.toml")
    definition = read_definition(_HERE / f"{name}.yaml")
    server = RtcCanopenServer(definition, _device_files(definition))
    stick = server.manager.add(Joystick("Joystick0"), rate_hz=20.0)
    server.manager.add(base, rate_hz=100.0)
    server.manager.activate("Joystick0", base.instance_name)
    link: Any = bench.link
    server.start()
    track = RobotTrack(base.spec.type_name)
    planned = Pose()
    echo(f"  time s  joystick %    {track.name} is at x, y, m, deg    thinks x, y, m, deg")
    end_us = link.now_us
    for forward_pct, left_pct, duration_s in _WAY:
        stick.tilt(forward_pct, left_pct)
        end_us += duration_s * _SECOND_US
        asked = (forward_pct / 100 * stick.full_v.value, 0.0, left_pct / 100 * stick.full_w.value)
        while link.now_us < end_us:
            serve(server, link, link.now_us + LOOK_US)
            planned = advanced(planned, asked, LOOK_US / _SECOND_US)
            x_m, y_m, heading_deg = (
                float(bench.get(f"body/{output}")) for output in ("x_m", "y_m", "heading_deg")
            )
            pose = Pose(x_m, y_m, radians(heading_deg))
            track.looks.append(RobotSample(link.now_us / _SECOND_US, pose, planned))
            if link.now_us % _ROW_US == 0:
                echo(
                    f"{link.now_us / _SECOND_US:8.1f}{forward_pct:6}{left_pct:6}"
                    f"{_place(pose)}{_place(base.pose)}"
                )
    return track


def _place(pose: Pose) -> str:
    return f"{pose.x:9.2f}{pose.y:7.2f}{degrees(pose.heading):7.1f}"


def _device_files(definition: SystemDefinition) -> dict[str, DeviceFile]:
    """Read the data of the EDS files of a definition, which an installation does not have."""
    files = {}
    with TemporaryDirectory() as folder:
        for name in {node.eds for node in definition.nodes}:
            path = Path(folder, Path(name).name)
            device = MODELS[path.stem].describe()
            write_whole(path, write_eds(device.template.description, device.info))
            files[name] = read_device_file(path)
    return files
