"""A cart in real time, for others to work with: `rh3 serve`."""

from __future__ import annotations

from dataclasses import replace

import click

from tickrig.emulators.rh3.cart.options import MotionOptions
from tickrig.host.cli.engine_options import EngineOptions
from tickrig.host.cli.messages import say, warnings_shown
from tickrig.host.cli.refused import Refused
from tickrig.host.cli.serving import stopped_by_signals
from tickrig.host.control.clock import ServingClock
from tickrig.host.engines.engines_joined import engines_joined
from tickrig.host.motion.chain import MotionChain
from tickrig.host.motion.drive import PERIOD_US, BaseConnection, stop
from tickrig.host.rtc.remote.call_queue import CallQueue


class ServedCart:
    """Moves a cart on until somebody stops it; others are served while it waits.

    Args:
        connection: the cart, with its components.
        clock: what the cart waits by.

    Attributes:
        running: False once `stop` was called.
    """

    def __init__(self, connection: BaseConnection, clock: ServingClock) -> None:
        self._connection, self._clock, self.running = connection, clock, True

    def attach(self, calls: CallQueue) -> None:
        """Make the calls of other threads while it waits."""
        self._clock.serve = calls.serve

    def run(self) -> None:
        """Run until somebody calls `stop`."""
        while self.running:
            self._connection.run_to(self._connection.now_us + PERIOD_US)

    def stop(self) -> None:
        """End `run` after the present period."""
        self.running = False


def serve_cart(options: MotionOptions, engines: EngineOptions) -> None:
    """Run a cart until Ctrl-C, or until a peer ends it; then its components are deactivated.

    Where velocities come from a topic, it obeys these, and not PathFollower.

    Raises:
        Refused: there is no engine by which others could reach it, or no cart.
    """
    if not engines:
        wanted = "--openrtm or --ros2"
        raise Refused(f"rh3 serve wants {wanted}: else nobody could work with the cart")
    clock = ServingClock()
    connection = replace(options, clock=clock).begin()
    cart = ServedCart(connection, clock)
    chain = connection.chain
    names = ", ".join(component.instance_name for component in chain.components)
    with warnings_shown(), stopped_by_signals(cart.stop):
        with engines_joined(engines, chain.manager, cart.attach, cart.stop, fixed=True):
            say(f"{names}. Ctrl-C ends.")
            _let_peers_drive(chain)
            cart.run()
        clock.serve = None
        stop(connection)
    pose = connection.pose
    click.echo(f"ran {connection.now_us / 1e6:.3f} s; at {pose.x:.3f} {pose.y:.3f} m")


def _let_peers_drive(chain: MotionChain) -> None:
    """Where velocities come from a peer, take none from PathFollower."""
    connectors = chain.ref_hard.velocity.connectors
    if all(connector.joins_components for connector in connectors):
        return
    for connector in connectors:
        if connector.joins_components:
            connector.end()
