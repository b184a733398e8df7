"""Joining a system with the engines that a command line names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Final

from tickrig.host.cli.engine_options import EngineOptions, Ros2Options
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.start import load
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.manager import Manager

_OPENRTM: Final = "tickrig.host.rtc.engines.openrtm.engine:openrtm_joined"
_NEEDS_OMNIORB: Final = "--openrtm needs omniORB: pip install 'tickrig[openrtm]'"
_ROS2: Final = "tickrig.host.rtc.engines.ros2.engine:ros2_joined"
_NEEDS_CYCLONE: Final = "--ros2 needs Cyclone DDS: pip install 'tickrig[ros2]'"


@contextmanager
def engines_joined(
    options: EngineOptions,
    manager: Manager,
    attach: Callable[[CallQueue], object],
    stop: Callable[[], object],
    *,
    fixed: bool = False,
) -> Iterator[None]:
    """Context manager that connects a system with other processes.

    The code that connects by OpenRTM, and the code that connects by ROS 2, are called engines.

    Args:
        options: engines to use, with their settings.
        manager: manager of the system, which is not running yet.
        attach: function that is called once with a `CallQueue`. The engines do not call the manager
            directly. They put these calls into the queue. The function must make the manager's
            thread execute these calls.
        stop: function that ends the command. It is called if another process requests the end.
        fixed: whether other processes must not create or end components of this system.

    Raises:
        Refused: a package that an engine needs is not installed, or the options are not supported.
    """
    with ExitStack() as stack:
        calls = CallQueue()
        stack.callback(calls.close)
        attach(calls)
        if options.openrtm is not None:
            try:
                openrtm_joined = load(_OPENRTM)
                stack.enter_context(
                    openrtm_joined(options.openrtm, manager, calls, stop, fixed=fixed)
                )
            except ImportError as error:
                if (error.name or "").partition(".")[0] not in ("omniORB", "CosNaming"):
                    raise
                raise Refused(_NEEDS_OMNIORB) from None
            except (ValueError, RuntimeError) as error:
                raise Refused(f"--openrtm: {error}") from None
        if options.ros2 is not None:
            _join_ros2(stack, options.ros2, manager, calls)
        yield


def _join_ros2(stack: ExitStack, options: Ros2Options, manager: Manager, calls: CallQueue) -> None:
    try:
        stack.enter_context(load(_ROS2)(options, manager, calls))
    except ImportError as error:
        if (error.name or "").partition(".")[0] != "cyclonedds":
            raise
        raise Refused(_NEEDS_CYCLONE) from None
    except OSError as error:
        refuse_path("ros2-table", error)
    except UnicodeDecodeError as error:
        raise Refused(f"ros2-table {options.table}: byte {error.start} is no UTF-8") from None
    except ValueError as error:
        raise Refused(f"--ros2: {error}") from None
