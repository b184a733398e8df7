"""What tests devices of anybody: for the extra `test`, which brings pytest and Hypothesis."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.emulators.testing import strategies as strategies
    from tickrig.emulators.testing.check_device import check_device as check_device
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.emulators.testing": ("strategies",),
            "tickrig.emulators.testing.check_device": ("check_device",),
        },
    )
