"""RRC: a synchronous client for the Robotic Relay Communicator, and its command."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.host.rrc.channel import RrcLoad as RrcLoad
    from tickrig.host.rrc.channel import RrcRefused as RrcRefused
    from tickrig.host.rrc.channel import RrcStopped as RrcStopped
    from tickrig.host.rrc.client import RrcClient as RrcClient
    from tickrig.host.rrc.inbox import Arrival as Arrival
    from tickrig.host.rrc.reply_matcher import OnRefusals as OnRefusals
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.host.rrc.channel": ("RrcLoad", "RrcRefused", "RrcStopped"),
            "tickrig.host.rrc.client": ("RrcClient",),
            "tickrig.host.rrc.inbox": ("Arrival",),
            "tickrig.host.rrc.reply_matcher": ("OnRefusals",),
        },
    )
