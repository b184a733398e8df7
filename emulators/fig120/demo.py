"""`tickrig demo fig120`: set up, leave the bus, turn the potentiometer, watch the motor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import cos, pi
from typing import Final

from tickrig.emulators.fig120.samples import HEAD, Sample, row
from tickrig.emulators.fig120.set_up import LINK, MOTOR, PALETTE, WRITES, set_up
from tickrig.emulators.fig120.stage import Stage
from tickrig.host.text.values import Setting

Echo = Callable[[str], None]

STEPS_V: Final = (0.0, 1.25, 2.5, 3.75, 5.0)
STEP_US: Final = 600_000
TURN_US: Final = 2_000_000
REST_US: Final = 300_000
PERIOD_US: Final = 100_000
"""A line of the table each tenth of a second."""

POTENTIOMETER: Final = f"{PALETTE}/ai1_v"
REFERENCE: Final = f"{MOTOR}/0x6411:1"
SHAFT: Final = f"{MOTOR}/angle_deg"

AT_REST_DEG: Final = 0.01


@dataclass(frozen=True, slots=True)
class Act:
    """A part of the demonstration.

    Attributes:
        title: what happens.
        duration_us: how long it takes.
        volts: what the potentiometer says, by the share of the act that has passed, 0..1.
        is_step: the shaft arrives within the act.
    """

    title: str
    duration_us: int
    volts: Callable[[float], float]
    is_step: bool = False


def acts() -> Iterator[Act]:
    """Give the steps of the report's table, then a slow turn back."""
    for volts in STEPS_V:
        yield Act(
            f"The potentiometer is set to {volts} V.", STEP_US, partial(_held, volts), is_step=True
        )
    yield Act("It is turned back slowly.", TURN_US, _turned_back)
    yield Act("It rests.", REST_US, partial(_held, 0.0))


def _held(volts: float, done: float) -> float:
    return volts


def _turned_back(done: float) -> float:
    return round(STEPS_V[-1] / 2 * (1 + cos(pi * done)), 3)


def run_demo(stage: Stage, echo: Echo) -> list[Sample]:
    """Play it.

    Returns:
        All samples.

    Raises:
        canopen.SdoCommunicationError: a node does not answer.
    """
    echo(f"Node {PALETTE} is an f-palette with a potentiometer at its analogue input 1.")
    echo(f"Node {MOTOR} is a motor core unit.\n")
    for write in WRITES:
        value = f"{write.value:0{2 * write.size}X}h"
        echo(
            f"  node {write.node_id}  {write.index:04X}h:{write.sub:02X} = {value:<10}{write.text}"
        )
    set_up(stage.network)
    stage.network.disconnect()
    echo(f"\nBoth are started; {LINK:03X}h links them. The master has left the bus.")
    return _turn(stage, echo)


def _turn(stage: Stage, echo: Echo) -> list[Sample]:
    samples: list[Sample] = []
    start_us = begin_us = stage.now_us
    for act in acts():
        echo(f"\n{act.title}\n{HEAD}")
        first = len(samples)
        for at_us in range(begin_us, begin_us + act.duration_us, stage.step_us):
            stage.run_to(at_us)
            stage.set(POTENTIOMETER, act.volts((at_us - begin_us) / act.duration_us))
            sample = _look(stage, start_us)
            if (at_us - begin_us) % PERIOD_US < stage.step_us:
                echo(row(sample))
            samples.append(sample)
        begin_us += act.duration_us
        if act.is_step:
            echo(_arrival(samples[first:]))
    return samples


def _look(stage: Stage, start_us: int) -> Sample:
    return Sample(
        (stage.now_us - start_us) / 1e6,
        _number(stage.get(POTENTIOMETER)),
        int(_number(stage.get(REFERENCE))),
        _number(stage.get(SHAFT)),
    )


def _arrival(samples: list[Sample]) -> str:
    """Say when the shaft came to rest at the last reference."""
    wanted = samples[-1].reference_deg
    late = [sample for sample in samples if abs(sample.angle_deg - wanted) > AT_REST_DEG]
    after_s = (late[-1].time_s if late else samples[0].time_s) - samples[0].time_s
    return f"At {wanted:.4f} deg after {after_s:.3f} s."


def _number(value: Setting) -> float:
    assert not isinstance(value, str)
    return value
