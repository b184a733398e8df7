"""A servo in virtual time: what a millisecond of it costs."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.table import RUNS, row, seconds
from tickrig.device.servo.parameters import PRESETS
from tickrig.device.servo.servo import STEP_US, Servo

STEPS = 20_000


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    for name in PRESETS:
        position(name)
        velocity(name)
        released(name)
        rest(name)


def position(name: str) -> None:
    """Follow a new position, velocity and acceleration each millisecond."""
    servo = Servo(PRESETS[name])

    def follow(ms: int) -> None:
        phase = ms % 2_000 - 1_000  # there and back, 10 counts a millisecond
        servo.drive_position(10.3 * abs(phase), 10_300.0 if phase > 0 else -10_300.0, 0.0)

    cost(f"{name}, a new position each ms", servo, follow)


def velocity(name: str) -> None:
    """Keep a velocity."""
    servo = Servo(PRESETS[name])
    servo.drive_velocity(20_000)
    cost(f"{name}, constant velocity", servo)


def released(name: str) -> None:
    """Be turned by a load."""
    servo = Servo(PRESETS[name])
    servo.load_nm = 2.0
    cost(f"{name}, released, turned by a load", servo)


def rest(name: str) -> None:
    """Hold a position against a load."""
    servo = Servo(PRESETS[name])
    servo.load_nm = 2.0
    servo.drive_position(1_000)
    servo.step_to(5_000_000)
    assert servo.resting
    cost(f"{name}, at rest, asked each ms", servo)


def cost(what: str, servo: Servo, demand: Callable[[int], None] = lambda ms: None) -> None:
    """Print what a step of a servo takes."""

    def work() -> None:
        for ms in range(STEPS):
            demand(ms)
            servo.step_to(servo.now_us + STEP_US)

    values = []
    for _ in range(RUNS):
        values.append(seconds(work)[0] / STEPS * 1e6)
    row(what, values, "us/ms")
