"""What is said before a proxy is an RT component: state, profile, execution context, initialize."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.host.links.errors import DeviceRefused, LinkTimeout
from tickrig.host.rtc.lite.request_channel import RequestChannel
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteContextType, LiteState
from tickrig.wire.rtc_lite.messages import LitePortProfile, LiteReply, parse_component_profile


@dataclass(frozen=True, slots=True)
class DeviceProfile:
    """What a device says of itself.

    Attributes:
        type_name: type of its component.
        in_ports: its in-ports.
        out_ports: its out-ports.
        context: who makes it execute.
    """

    type_name: str
    in_ports: tuple[LitePortProfile, ...]
    out_ports: tuple[LitePortProfile, ...]
    context: LiteContextType

    @property
    def properties(self) -> dict[str, str]:
        """What the profile of its proxy says of it."""
        return {
            "rtc_lite.type_name": self.type_name,
            "rtc_lite.context": f"0x{self.context:02X}",
        }


def start_up(channel: RequestChannel, boot_us: int) -> DeviceProfile:
    """Bring a device to Inactive, and ask what it is.

    Raises:
        LinkTimeout: no reply.
        DeviceRefused: a reply that does not lead to Inactive.
        WireError: a profile that cannot be read.
    """
    channel.listen(boot_us)
    _demand(LiteCommand.STATE, channel.request_again(LiteCommand.STATE))
    if channel.state is LiteState.ACTIVE:
        _demand(LiteCommand.DEACTIVATE, channel.request(LiteCommand.DEACTIVATE))
    elif channel.state is LiteState.ERROR:
        _demand(LiteCommand.RESET, channel.request(LiteCommand.RESET))
    profile = _request_profile(channel)
    if channel.state is LiteState.CREATED:
        _demand(LiteCommand.INITIALIZE, channel.request(LiteCommand.INITIALIZE))
    if channel.state is not LiteState.INACTIVE:
        state = "unknown" if channel.state is None else channel.state.name
        raise DeviceRefused(f"the state of the device is {state}, not INACTIVE", state)
    channel.pushed.clear()
    return profile


def _request_profile(channel: RequestChannel) -> DeviceProfile:
    reply = _demand(LiteCommand.PROFILE, channel.request_again(LiteCommand.PROFILE))
    announced = parse_component_profile(reply.fields)
    ins, outs = tuple(channel.in_ports), tuple(channel.out_ports)
    if (len(ins), len(outs)) != (announced.in_ports, announced.out_ports):
        counts = f"{announced.in_ports} in-ports and {announced.out_ports} out-ports"
        raise DeviceRefused(f"{counts} announced, {len(ins)} and {len(outs)} described", "CZ")
    return DeviceProfile(
        announced.type_name.decode("latin-1"), ins, outs, _request_context(channel)
    )


def _request_context(channel: RequestChannel) -> LiteContextType:
    code = _demand(LiteCommand.CONTEXT, channel.request_again(LiteCommand.CONTEXT)).fields[0]
    try:
        return LiteContextType(code)
    except ValueError:
        text = f"execution context 0x{code:02X}, 0x21 and 0x22 are known"
        raise DeviceRefused(text, "BB") from None


def _demand(command: LiteCommand, reply: LiteReply | None) -> LiteReply:
    """Return a reply that is there and OK."""
    name = command.value.decode()
    if reply is None:
        raise LinkTimeout(f"no reply to {name}")
    if not reply.ok:
        raise DeviceRefused(f"{name} was refused with {reply.status:#04x}", chr(reply.status))
    return reply
