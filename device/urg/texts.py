"""What a URG-04LX tells of itself (URG network, status information)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.wire.sensors.scip import status

BY_DEFAULT: Final = "<-Default setting by user"

CONDITION: Final[Mapping[str, str]] = {
    "": "Sensor works well.",
    status.LASER_TROUBLE: "Laser trouble.",
    status.MOTOR_TROUBLE: "Motor trouble.",
}
"""By the status of what is broken; the texts of the troubles are ours."""


def first_version(serial: str) -> Mapping[str, str]:
    """Return what V tells in SCIP 1.1 (HokuyoAIST; a recording in regilo)."""
    return {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00,07/01/18(20-4095[mm],240[deg],44-725[step],600[rpm])",
        "PROT": "00003,(SCIP 1.0)",
        "SERI": serial,
    }


def version(serial: str) -> Mapping[str, str]:
    """Return what VV tells."""
    return {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00(18/Jan./2007)",
        "PROT": "SCIP 2.0",
        "SERI": serial,
    }
