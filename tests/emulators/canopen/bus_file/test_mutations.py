"""Damaged bus.yml and URDF files make slaves that run, or are told to be wrong with their lines."""

from __future__ import annotations

import random
import re
from contextlib import suppress
from pathlib import Path

import pytest

from tests.emulators.canopen.bus_file.joint_sheet import joint_sheet
from tests.soak import SOAK
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import Described, make_nodes
from tickrig.emulators.canopen.bus_file.bus_nodes import read_bus
from tickrig.emulators.canopen.bus_file.node_keys import BusMistakesError
from tickrig.emulators.canopen.eds import EdsCache

EXAMPLE = Path(__file__).parents[4] / "examples/ros2_canopen"
KEYS = """\
    tickrig:
      motor: motor-core-unit
      gear_ratio: 50
      gear_efficiency: 0.9
      friction_nm: 0.2
      effort: 40
      velocity: 2
      lower: -1
      upper: 1
      home_switch: [0, 0.1]
      modes: [pp, ip]
      start: {load_nm: 3, '0x6081': 5}
      encoder_counts: 4096
      supply_v: 48
      units: 2000
"""
VALUES = (
    *("0", "-1", "1e30", ".nan", ".inf", "-.inf", "[]", "{}", "null", "true", "''", "x", "1e-300"),
    *("99999999999999999999", "[1, 2, 3]", "{a: 1}", "0x10", "2001-01-01", "!!binary AA==", "&a"),
)
SIGNS = "{}[]:-,'\"#&*!|>%@`\t\n 0a<>/\0é$"


def damaged(chance: random.Random, text: str) -> str:
    """Change a text in one to three places."""
    for _ in range(chance.randint(1, 3)):
        lines, at = text.split("\n"), chance.randrange(len(text) + 1)
        match chance.randrange(5):
            case 0:
                text = text[:at] + chance.choice(SIGNS) + text[at + chance.randint(0, 2) :]
            case 1:
                del lines[chance.randrange(len(lines))]
                text = "\n".join(lines)
            case 2:
                lines.insert(chance.randrange(len(lines)), chance.choice(lines))
                text = "\n".join(lines)
            case 3 | 4:
                found = list(re.finditer(r"(?<=[:\[,] )[^,\[\]{}\n#]+|(?<=\")[^\"]+", text))
                if found:
                    match = chance.choice(found)
                    text = text[: match.start()] + chance.choice(VALUES) + text[match.end() :]
    return text


@pytest.mark.parametrize("seed", range(8 * SOAK))
def test_a_damaged_file_never_ends_in_a_traceback(tmp_path: Path, seed: int) -> None:
    chance, cache, path = random.Random(seed), EdsCache(), tmp_path / "bus.yml"
    bus = (EXAMPLE / "bus.yml").read_text("utf-8").replace("    tickrig: {modes: all}\n", KEYS)
    urdf = (EXAMPLE / "arm.urdf").read_text("utf-8")
    (tmp_path / "joint.eds").write_text(joint_sheet())
    for number in range(12):
        path.write_text(damaged(chance, bus) if number % 4 else bus, "utf-8")
        robot = urdf if number % 4 else damaged(chance, urdf)
        (tmp_path / "arm.urdf").write_text(robot, "utf-8")
        with suppress(BusMistakesError):
            nodes = read_bus(path, cache=cache).nodes
            described = [Described(each.name, each.node_id, each.description) for each in nodes]
            for node in make_nodes(described, CanWire()):
                for now_us in range(1_000, 5_000, 1_000):
                    node.tick(now_us, ())
