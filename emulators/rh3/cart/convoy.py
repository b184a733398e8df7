"""Robots that go together: carts on two wheels and on omni wheels, in one map frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from tickrig.device.body.pose import Pose as BodyPose
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.cart.closed_loop import Cart, ClosedLoop
from tickrig.emulators.rh3.cart.omni_cart import OmniCart
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.options.follower import Follower

WIDE: Final = {"dataport.buffer.length": "64"}


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot of a convoy, by the names of its ports.

    Attributes:
        position: where its self-position leaves.
        velocity: where its moving command arrives.
        look: returns where it truly is.
        sideways: it goes any way.
    """

    position: str
    velocity: str
    look: Callable[[], Pose]
    sideways: bool = False

    @property
    def truth(self) -> Pose:
        """Where it is."""
        return self.look()


class Convoy:
    """Robots in virtual time; the first keeps its planner, the others do what is joined to them.

    Args:
        carts: where those on two wheels stand at first.
        omni: where those on omni wheels stand.

    Attributes:
        loop: carts, their lines and the manager.
        robots: carts first.
    """

    def __init__(self, carts: Sequence[Pose], omni: Sequence[Pose] = ()) -> None:
        self.loop = ClosedLoop(*[BaseParameters() for _ in carts])
        self.robots = (
            *(self._cart(n, pose) for n, pose in enumerate(carts)),
            *(self._omni_cart(n, pose) for n, pose in enumerate(omni)),
        )
        self._leaders: dict[int, int] = {}

    def follow(self, robot: int, leader: int) -> None:
        """Let a robot follow another from now on; whom it followed before is forgotten."""
        manager, name = self.loop.manager, f"Follower{robot}"
        if robot not in self._leaders:
            self._add_follower(robot, name)
        else:
            before = self.robots[self._leaders[robot]]
            manager.disconnect(before.position, f"{name}.leader")
        manager.connect(self.robots[leader].position, f"{name}.leader", WIDE)
        self._leaders[robot] = leader

    def command(self, source: str) -> None:
        """Let all robots obey one OutPort of IIS velocities, in the place of their planners."""
        manager = self.loop.manager
        manager.disconnect("PathFollower.velocity", self.robots[0].velocity)
        for robot in self.robots:
            manager.connect(source, robot.velocity, WIDE)

    def _add_follower(self, robot: int, name: str) -> None:
        manager, own = self.loop.manager, self.robots[robot]
        follower = Follower(name)
        follower.configuration.set("sideways", str(int(own.sideways)))
        context = manager.context_of(own.velocity.partition(".")[0])
        manager.add(follower, context=context)
        manager.connect(own.position, f"{name}.position", WIDE)
        manager.connect(f"{name}.velocity", own.velocity, WIDE)
        manager.activate(name)

    def _cart(self, number: int, pose: Pose) -> Robot:
        cart, manager = self.loop.carts[number], self.loop.manager
        place(cart, pose)
        suffix = str(number) if number else ""
        velocity = f"RefHardRh3{suffix}.InTargetVelocity"
        if number:
            manager.disconnect(f"PathFollower{suffix}.velocity", velocity)
        return Robot(f"Odometry{suffix}.OdometryPosition", velocity, lambda: cart.truth)

    def _omni_cart(self, number: int, pose: Pose) -> Robot:
        name = f"OmniCart{number}"
        cart = self.loop.manager.add(OmniCart(name), rate_hz=50.0)
        cart.place(pose)
        self.loop.manager.activate(name)
        look: Callable[[], Pose] = lambda: cart.truth  # noqa: E731 - beside that of a cart
        return Robot(f"{name}.OdometryPosition", f"{name}.InTargetVelocity", look, sideways=True)


def place(cart: Cart, pose: Pose) -> None:
    """Put a cart somewhere, and let its odometry begin there."""
    cart.base.ground.pose = BodyPose(*pose)
    configuration = cart.chain.odometry.configuration
    for name, number in zip(("x", "y", "theta"), pose, strict=True):
        configuration.set(f"initialPose_{name}", repr(number))
