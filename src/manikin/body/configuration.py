"""One configuration of a body and what follows from it: frames, Jacobians, dynamics."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Self

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body.model import BodyModel
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray

_WORLD_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Configuration:
    """The state ``(q, v)`` of a body, with everything computed at most once per update.

    Velocities of points and frames, Jacobians and momenta are in world axes; ``v`` itself has the root's in
    the root segment's axes. Returned arrays are read-only and stay valid after the next update.
    """

    def __init__(self, body: BodyModel, q: ArrayLike | None = None, v: ArrayLike | None = None) -> None:
        self.body = body
        self._frames = body.pinocchio.createData()
        self._results: dict[Any, Any] = {}
        self._zero = np.zeros(body.nv)
        self.update(body.standing_posture() if q is None else q, v)

    def update(self, q: ArrayLike, v: ArrayLike | None = None) -> Self:
        """Move to ``q`` (nq,) and ``v`` (nv,), zero when left out; BodyError if a length is wrong."""
        self.q = _vector(q, self.body.nq, "q")
        self.v = _vector(self._zero if v is None else v, self.body.nv, "v")
        self._results.clear()
        pin.framesForwardKinematics(self.body.pinocchio, self._frames, self.q)
        return self

    # Separate data, because Pinocchio's algorithms overwrite each other's intermediate results; shared by all
    # states of a body, as making them takes longer than placing frames and each result is copied at once.
    @property
    def _dynamics(self) -> pin.Data:
        return _scratch(self.body)

    def _once(self, key: Any, compute: Callable[[], Any]) -> Any:
        if key not in self._results:
            result = compute()
            self._results[key] = _read_only(result) if isinstance(result, np.ndarray) else result
        return self._results[key]

    @property
    def com(self) -> FloatArray:
        """(3,) centre of mass [m]."""
        return self._once("com", lambda: pin.centerOfMass(self.body.pinocchio, self._frames, self.q, False))

    @property
    def com_velocity(self) -> FloatArray:
        """(3,) velocity of the centre of mass [m/s]."""
        return self._once("com_velocity", lambda: self.com_jacobian @ self.v)

    @property
    def com_jacobian(self) -> FloatArray:
        """(3, nv) with ``com_velocity = com_jacobian @ v``."""
        return self._once("com_jacobian", lambda: self.centroidal_map[:3] / self.body.mass)

    @property
    def centroidal_map(self) -> FloatArray:
        """(6, nv): linear momentum and angular momentum about the centre of mass, per ``v``."""
        model = self.body.pinocchio
        return self._once("centroidal_map", lambda: pin.computeCentroidalMap(model, self._dynamics, self.q))

    @property
    def angular_momentum(self) -> FloatArray:
        """(3,) about the centre of mass [kg.m^2/s]."""
        return self._once("angular_momentum", lambda: self.centroidal_map[3:] @ self.v)

    def effector_placement(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) from the effector's axes to the world's, and position (3,) [m]."""
        return self._placement(self.body.effector_frame(name))

    def segment_placement(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) from the segment's axes to the world's, and position (3,) [m]."""
        return self._placement(self.body.segment_frame(name))

    def effector_jacobian(self, name: str) -> FloatArray:
        """(6, nv) linear, then angular velocity of the effector in world axes, per ``v``."""
        return self._jacobian(self.body.effector_frame(name))

    def segment_jacobian(self, name: str) -> FloatArray:
        """(6, nv) linear, then angular velocity of the segment frame in world axes, per ``v``."""
        return self._jacobian(self.body.segment_frame(name))

    def point(self, segment: str, offset: ArrayLike) -> FloatArray:
        """(3,) world position of a point fixed to a segment at ``offset`` (3,) in its axes [m]."""
        rotation, position = self.segment_placement(segment)
        return position + rotation @ np.asarray(offset, dtype=np.float64)

    def point_jacobian(self, segment: str, offset: ArrayLike) -> FloatArray:
        """(3, nv) velocity of a point fixed to a segment at ``offset`` (3,) in its axes, per ``v``."""
        rotation, _ = self.segment_placement(segment)
        jacobian = self.segment_jacobian(segment)
        arm = rotation @ np.asarray(offset, dtype=np.float64)
        return jacobian[:3] + np.cross(jacobian[3:], arm, axisa=0, axisb=0, axisc=0)

    def _placement(self, frame: int) -> tuple[FloatArray, FloatArray]:
        def compute() -> tuple[FloatArray, FloatArray]:
            place = self._frames.oMf[frame]
            return _read_only(place.rotation), _read_only(place.translation)

        return self._once(("placement", frame), compute)

    def _jacobian(self, frame: int) -> FloatArray:
        model = self.body.pinocchio
        self._once("joint_jacobians", lambda: pin.computeJointJacobians(model, self._frames))
        return self._once(
            ("jacobian", frame), lambda: pin.getFrameJacobian(model, self._frames, frame, _WORLD_ALIGNED)
        )

    @property
    def mass_matrix(self) -> FloatArray:
        """(nv, nv) symmetric inertia matrix ``M`` of ``M a + h = tau + J^T f``."""
        return self._once("mass_matrix", self._compute_mass_matrix)

    def _compute_mass_matrix(self) -> FloatArray:
        upper = np.triu(pin.crba(self.body.pinocchio, self._dynamics, self.q, pin.Convention.WORLD))
        return upper + np.triu(upper, 1).T

    @property
    def nonlinear_effects(self) -> FloatArray:
        """(nv,) ``h``: Coriolis, centrifugal and gravity forces [N, N.m]."""
        state = self.body.pinocchio, self._dynamics, self.q, self.v
        return self._once("nonlinear_effects", lambda: pin.nonLinearEffects(*state))


@lru_cache(maxsize=16)
def _scratch(body: BodyModel) -> pin.Data:
    """Data of a body that keep nothing from one call to the next."""
    return body.pinocchio.createData()


def integrate(body: BodyModel, q: ArrayLike, v: ArrayLike, dt: float = 1.0) -> FloatArray:
    """(nq,) configuration reached from ``q`` with the constant velocity ``v`` during ``dt`` [s]."""
    return pin.integrate(body.pinocchio, _vector(q, body.nq, "q"), dt * _vector(v, body.nv, "v"))


def difference(body: BodyModel, start: ArrayLike, end: ArrayLike) -> FloatArray:
    """(nv,) velocity that leads from ``start`` to ``end`` in unit time."""
    return pin.difference(body.pinocchio, _vector(start, body.nq, "start"), _vector(end, body.nq, "end"))


def interpolate(body: BodyModel, start: ArrayLike, end: ArrayLike, share: float) -> FloatArray:
    """(nq,) configuration on the geodesic, ``start`` at ``share`` 0 and ``end`` at 1."""
    first, last = _vector(start, body.nq, "start"), _vector(end, body.nq, "end")
    return pin.interpolate(body.pinocchio, first, last, float(share))


def random_configuration(body: BodyModel, rng: np.random.Generator) -> FloatArray:
    """(nq,) random configuration: hinges uniform in their ranges, the root within 1 m of 0 on each axis."""
    quaternion = rng.standard_normal(4)
    angles = rng.uniform(body.lower, body.upper)
    position = rng.uniform(-1.0, 1.0, 3)
    return np.concatenate([position, quaternion / np.linalg.norm(quaternion), angles])


def _vector(value: ArrayLike, size: int, name: str) -> FloatArray:
    array = np.array(value, dtype=np.float64)
    if array.shape != (size,):
        raise BodyError(f"configuration {name} has shape {array.shape}; valid: ({size},)")
    return array


def _read_only(values: FloatArray) -> FloatArray:
    copy = np.array(values)
    copy.setflags(write=False)
    return copy
