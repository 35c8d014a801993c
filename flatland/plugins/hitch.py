"""A coupling that connects two models on command, for trailers, trolleys and docks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flatland.errors import WorldError
from flatland.geometry import compose, invert
from flatland.physics import ALL_BITS
from flatland.plugin_api.occasional_warning import OccasionalWarning
from flatland.plugin_api.parameters import (
    MAX_COORDINATE,
    at_key,
    read_body_or_first,
    read_choice,
    read_point,
    read_rate,
)
from flatland.plugin_api.plugin import ModelPlugin

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from flatland.config.reader import YamlReader
    from flatland.entities.body import Body
    from flatland.entities.model import Model
    from flatland.geometry import Pose
    from flatland.physics import PhysicsJoint
    from flatland.timekeeper import Timekeeper

TYPES = ("hinge", "weld")

_DEFAULT_RATE = 10.0  # Hz
_PRECISION = 1e-4  # m, of distances from the hook


class Hitch(ModelPlugin):
    """Connects a point of its body to the nearest other model, and releases it again.

    The command `hitch` (`bool`) hitches and releases, before the next step. `attach` and `detach`
    are the same for Python programs. A connection ends if one of the models is moved or deleted.
    """

    recorded_methods = frozenset(["connect", "release"])

    def on_initialize(self, config: YamlReader) -> None:
        """Reads the parameters and declares the ports."""
        self._body = read_body_or_first(config, self.model, "body")
        self._origin = read_point(config, "origin")
        self._type = read_choice(config, "joint", TYPES)
        self._reach: float = config.get("reach", "float", 0.1, minimum=0, maximum=MAX_COORDINATE)
        self._max_angle: float = config.get("max_angle", "angle", 0.0, minimum=0, maximum=math.pi)
        if self._max_angle and self._type == "weld":
            raise at_key(config, "max_angle").error('"max_angle" requires "joint: hinge"')
        self._names = config.get_list("models", "string", [])
        self._collides: bool = config.get("collide", "bool", False)
        self._warning = OccasionalWarning()
        self._joint: PhysicsJoint | None = None
        self._other: Model | None = None
        rate = read_rate(config, default=_DEFAULT_RATE)
        self._output = self.output(config.get("state_topic", "string", "hitched"), bool)
        is_hitched = config.get("start", "bool", False)
        topic = config.get("topic", "string", "hitch")
        self._command = self.command(topic, bool, default=is_hitched)
        self._command.on_change = self._command_changed
        self._handled = -1 if is_hitched else 0  # number of commands carried out
        if is_hitched:
            # Before the first step, when all models of the world file exist.
            self._command_changed()
        self.on_update(self._publish, rate, outputs=[self._output])
        service = config.get("service", "string", "set_hitch")
        if self.ros is not None and service:
            from std_srvs.srv import SetBool

            self.ros.advertise_service(service, SetBool, self._serve)

    # -- commands --------------------------------------------------------------------------

    def _command_changed(self) -> None:
        self.set_before_step(self._obey)

    def _obey(self) -> None:
        """Carries out the last command once; logs a warning if that is not possible."""
        is_start = self._handled < 0
        is_wanted, received = self._command.state
        if self._handled == received:
            return
        self._handled = received
        if not is_wanted:
            self._disconnect()
            return
        try:
            self._connect_model(None)
        except WorldError as error:
            if not is_start:
                self._warning.log("%s", error)

    def _serve(self, request: Any) -> Any:
        """Handles a call of the service; called between two steps."""
        from std_srvs.srv import SetBoolResponse

        done, other = "released", self.hitched
        try:
            if request.data:
                done, other = "hitched", self.attach()
            else:
                self.detach()
        except WorldError as error:
            return SetBoolResponse(success=False, message=str(error))
        name = "nothing" if other is None else other.name
        return SetBoolResponse(success=True, message=f"{done}: {name}")

    @property
    def hitched(self) -> Model | None:
        """The model that is connected; None if there is none."""
        return self._other if self._joint is not None and self._joint.alive else None

    def attach(self, name: str | None = None) -> Model | None:
        """Connects a model between two steps; keeps an existing connection.

        Args:
            name: Name of the model; None for the nearest one within reach.

        Returns:
            The connected model; None if a hook calls this: it is then connected after the step.

        Raises:
            WorldError: No model, or no model of this name, is within reach, or its angle is
                beyond `max_angle`.
        """
        self.world.call_plugin(self, "connect", {"name": name})
        return self.hitched

    def detach(self) -> None:
        """Releases the connected model between two steps; without one, it has no effect."""
        self.world.call_plugin(self, "release", {})

    # -- methods that recordings repeat ----------------------------------------------------

    def connect(self, name: str | None = None) -> None:
        """Connects a model at once; see `attach`."""
        self._handled = self._command.received
        self._connect_model(name)

    def _connect_model(self, name: str | None) -> None:
        connected = self.hitched
        if connected is not None:
            if name in (None, connected.name):
                return
            raise WorldError(f'{self._who()} is already connected to "{connected.name}"')
        self._disconnect()
        nearest = min(self._within_reach(name), default=None, key=lambda found: found[0])
        if nearest is None:
            what = "no model" if name is None else f'model "{name}"'
            is_not = "is" if name is None else "is not"
            raise WorldError(f"{self._who()}: {what} {is_not} within {self._reach} m")
        _, body, model = nearest
        self._joint = self._connect(body)
        self._other = model
        model.followers.append(self)

    def release(self) -> None:
        """Releases the connected model at once; see `detach`."""
        self._handled = self._command.received
        self._disconnect()

    def _disconnect(self) -> None:
        if self._joint is not None and self._joint.alive:
            self._joint.destroy()
        if self._other is not None and self in self._other.followers:
            self._other.followers.remove(self)
        self._joint = self._other = None

    def _who(self) -> str:
        return f'plugin "{self.name}" of model "{self.model.name}"'

    # -- the nearest body ------------------------------------------------------------------

    def _within_reach(self, name: str | None) -> Iterator[tuple[float, Body, Model]]:
        """Yields the bodies of other models within reach, with their distance [m]."""
        x, y, _ = compose(self._body.pose, (*self._origin, 0.0))
        is_dynamic = self._body.type == "dynamic"
        for model in self.world.models:
            if model is self.model or (self._names and model.name not in self._names):
                continue
            if name is not None and model.name != name:
                continue
            for body in model.bodies:
                if not (is_dynamic or body.type == "dynamic"):
                    continue
                distance = self._distance(body, x, y)
                if distance <= self._reach:
                    yield distance, body, model

    def _distance(self, body: Body, x: float, y: float) -> float:
        """Returns the distance of a point from the shapes of a body, infinite beyond the reach."""
        if not self._is_within(body, x, y, self._reach):
            return math.inf
        near, far = 0.0, self._reach
        while far - near > _PRECISION:
            middle = (near + far) / 2
            if self._is_within(body, x, y, middle):
                far = middle
            else:
                near = middle
        return far

    def _is_within(self, body: Body, x: float, y: float, radius: float) -> bool:
        physics = self.world.physics
        return not physics.free_discs([(x, y, 0.0)], radius, ALL_BITS, only=[body])[0]

    def _connect(self, body: Body) -> PhysicsJoint:
        physics = self.world.physics
        pose, other = self._body.pose, body.pose
        ax, ay = self._origin
        bx, by, _ = compose(invert(other), compose(pose, (ax, ay, 0.0)))
        angle = other[2] - pose[2]
        if self._type == "weld":
            return physics.create_weld_joint(
                self._body,
                body,
                (ax, ay),
                (bx, by),
                reference_angle=angle,
                collide_connected=self._collides,
            )
        limits = None
        if self._max_angle:
            # The limits of the joint are relative to the angle at which it is created.
            bent = math.remainder(angle, math.tau)
            if abs(bent) > self._max_angle:
                raise WorldError(
                    f'{self._who()}: the angle to model "{body.entity.name}" is {bent:.3f} rad, '
                    f"beyond the limit of {self._max_angle:.3f}"
                )
            limits = (-self._max_angle - bent, self._max_angle - bent)
        return physics.create_revolute_joint(
            self._body, body, (ax, ay), (bx, by), limits=limits, collide_connected=self._collides
        )

    # -- hooks -----------------------------------------------------------------------------

    def _publish(self, timekeeper: Timekeeper) -> None:
        """Emits whether a model is connected."""
        del timekeeper
        if self._output.wanted:
            self._output.emit(self.hitched is not None)

    def model_moved(self, previous: Mapping[str, Pose], keep_odometry: bool) -> None:
        """Releases the connected model: this model or the other one was moved."""
        del previous, keep_odometry
        self._disconnect()

    def on_shutdown(self) -> None:
        """Releases the connected model."""
        self._disconnect()

    def state(self) -> object:
        """Returns the name of the connected model and the number of commands carried out."""
        connected = self.hitched
        return ("" if connected is None else connected.name, self._handled)
