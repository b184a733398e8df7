"""The steps that only checks of objects have: what an object holds, and writing it back wrongly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from tickrig.host.canopen.conform.bus.step_failed import StepFailed
from tickrig.host.canopen.conform.bus.unlike import codes_text
from tickrig.host.canopen.errors import SdoAborted, SdoMisnamed, SdoTimeout
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.sdo.abort import describe_abort


class Client(Protocol):
    """Reads and writes objects of the node under test."""

    def upload(self, index: int, sub: int, /) -> bytes:
        """Read an object; raises SdoAborted, SdoMisnamed and SdoTimeout."""
        ...

    def download(self, index: int, sub: int, data: bytes, /) -> None:
        """Write an object; raises SdoAborted, SdoMisnamed and SdoTimeout."""


def play_object_step(client: Client, step: Mapping[str, Any]) -> bool:
    """Do a step if it is one of an object.

    `holds` reads an object: it has a size that its data type has, lies within `low` and
    `high`, is `value`, where these are given; with `codes` it may be refused with one of
    them. `refuse rewrite` reads an object and writes it again, `grow` bytes longer or
    shorter: the node refuses that with one of `codes`.

    Args:
        client: of the node.
        step: with index and sub-index in place of names.

    Returns:
        Whether it was one.

    Raises:
        StepFailed: the node does not do as the step says.
    """
    try:
        match step:
            case {"holds": (index, sub)}:
                _hold(client, index, sub, step)
            case {"refuse rewrite": (index, sub), "grow": grow, "codes": codes}:
                _rewrite(client, index, sub, grow, codes)
            case _:
                return False
    except (SdoMisnamed, SdoTimeout) as error:
        raise StepFailed(str(error)) from error
    return True


def _hold(client: Client, index: int, sub: int, step: Mapping[str, Any]) -> None:
    try:
        data = client.upload(index, sub)
    except SdoAborted as error:
        if f"{error.code:08X}" in step.get("codes", ()):
            return
        raise StepFailed(f"refused with {describe_abort(error.code)}, want its value") from error
    kind = DataType[step["type"]]
    if kind.size and len(data) != kind.size:
        raise StepFailed(f"{len(data)} bytes, want {kind.size} of {kind.name}: {data.hex()}")
    if "value" in step and data.hex().upper() != step["value"]:
        raise StepFailed(f"holds {data.hex().upper()}, want {step['value']}")
    _check_limits(kind, data, step)


def _check_limits(kind: DataType, data: bytes, step: Mapping[str, Any]) -> None:
    low, high = step.get("low"), step.get("high")
    value = kind.decode(data)
    if not isinstance(value, int | float):
        return
    if low is not None and value < low:
        raise StepFailed(f"{value} is below its lower limit {low}")
    if high is not None and value > high:
        raise StepFailed(f"{value} is above its upper limit {high}")


def _rewrite(client: Client, index: int, sub: int, grow: int, codes: Sequence[str]) -> None:
    wanted = f"abort {codes_text(codes)}"
    try:
        data = client.upload(index, sub)
    except SdoAborted:
        return  # it holds nothing that could be written; what it should hold is another check
    data = data[:grow] if grow < 0 else data + bytes(grow)
    try:
        client.download(index, sub, data)
    except SdoAborted as error:
        if f"{error.code:08X}" not in codes:
            text = f"{len(data)} bytes refused with {describe_abort(error.code)}, want {wanted}"
            raise StepFailed(text) from error
    else:
        raise StepFailed(f"{len(data)} bytes were taken, want {wanted}")
