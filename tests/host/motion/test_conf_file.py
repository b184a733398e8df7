from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.host.motion.components.odometry import Odometry, read_conf
from tickrig.host.rtc import RtcRefused

TEXT = """\
# Odometry.conf
exec_cxt.periodic.rate: 50
conf.default.lengthOfAxle: 0.470   # on carpet
conf.carpet.radiusOfLeftWheel = 0.099
"""


def test_values_are_read_by_set_and_name(tmp_path: Path) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(TEXT)
    assert read_conf(path) == {
        "default": {"lengthOfAxle": "0.470"},
        "carpet": {"radiusOfLeftWheel": "0.099"},
    }


def test_values_of_the_file_take_the_place_of_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(TEXT)
    odometry = Odometry("Odometry0")
    odometry.load(path)
    odometry.configuration.update()
    assert (odometry.axle.value, odometry.left_radius.value) == (0.47, 0.0995)
    odometry.configuration.activate("carpet")
    odometry.configuration.update()
    assert (odometry.axle.value, odometry.left_radius.value) == (0.464, 0.099)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("conf.default: 1", "Odometry.conf:1: 'conf.default: 1' is not conf.SET.NAME: VALUE"),
        ("conf.default.axle: 1", "no parameter 'axle'; known: leftWheelID"),
        ("conf.default.lengthOfAxle: -1", "lengthOfAxle = -1 is not in x>0 m"),
        ("conf.default.lengthOfAxle: wide", "lengthOfAxle takes a value like 0.464 (float)"),
    ],
)
def test_a_mistake_in_the_file_is_refused(tmp_path: Path, line: str, told: str) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(line)
    with pytest.raises(RtcRefused) as refused:
        Odometry("Odometry0").load(path)
    assert told in str(refused.value)
