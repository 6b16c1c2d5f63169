"""The quadratic program of one step of the recovery, its objectives and the swing of the arms.

The program is that of [Kudoh2002]_ 2.54-2.64. Unknowns are the accelerations ``phi''`` of the closed loops
and the forces at the corners of the soles, which pull no foot down (``f_z > 0``) and keep to friction. The
thesis has the former alone: without the latter, joint torques on two feet cannot be limited.

Arms help against a fall ahead by being raised and swung; this part is ours. Of hanging arms that swing back,
the angular momentum about the centre of mass is next to nothing: that of their turning is undone by that of
their centres. Of arms overhead that swing forward and down both go with the fall, over half a turn and more,
which a program that looks at one instant cannot find out. So arms go up first, sideways to begin with, where
raising them costs little, and are then swung; meanwhile the trunk turns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from manikin.body import BodyModel
from manikin.control.build_qp import JointBounds
from manikin.control.dynamics import DynamicsState
from manikin.control.edge_forces import ContactForceBasis
from manikin.control.recovery.standing import ClosedLoop, FeltPush, JointGroups, LinearMap
from manikin.control.recovery.strategy import ComLaw, RecoverySettings
from manikin.control.reference import EffectorReference
from manikin.control.settings import Impedance
from manikin.control.tasks import AccelerationTask, orientation_task, swing_task
from manikin.numerics.qp import QuadraticProgram
from manikin.numerics.spatial import FloatArray

APART = 0.183
"""Time for which arms that go up go sideways too [s]."""

RAISED = 0.246
"""Time after which raised arms are swung [s]: about as long as raising them takes."""

SWUNG = 1.25
"""Time after which the swing is over [s]."""

PULL = Impedance(112.4, 21.2)
"""Of shoulders and elbows: critically damped, in some 0.3 s at the angle wanted."""

RAISING, SWINGING = 0.07, 0.3
"""Weights of their accelerations while they are raised and swung, against 1 of the other joints."""

UP, SIDEWAYS, BENT, DOWN = 3.057, 1.39, 0.63, -1.04
"""Angles of shoulders and elbows: flexion and abduction at most, the elbow on the way up, the end [rad]."""

CLEAR = 0.2
"""Abduction of swung arms: their hands pass by the thighs [rad]."""

FAR = 1.3
"""Reach of the settled point over the soles from which on arms are raised; the trunk alone does for less."""

AHEAD = np.cos(np.radians(60.0))
"""Cosine of the largest angle between straight ahead and a fall that is one ahead."""


class ArmSwing:
    """Raises and swings the arms once, where a body falls ahead and the trunk alone may not do."""

    def __init__(self, body: BodyModel, groups: JointGroups) -> None:
        """Find the joints by their groups; a body whose shoulders are not as a person's is left alone."""
        arms = {int(index): body.joint_names[index] for index in groups.joints["arm"]}
        flexion, abduction, elbow = (
            [index for index, name in arms.items() if name.endswith(end)]
            for end in ("shoulder_flexion", "shoulder_abduction", "elbow_flexion")
        )
        whole = len(flexion) == len(abduction) == len(elbow)
        # Hinge indices: flexion, then abduction of the shoulders, then elbows.
        self.joints = np.array(flexion + abduction + elbow if whole else [], dtype=np.int64)
        self._arms = len(flexion)
        self._began: float | None = None

    def begin(self, time: float, fall: FloatArray, reach: float, ahead: FloatArray) -> None:
        """Begin at a time [s] where the body falls far ahead, unless the arms have been swung already.

        The fall (2,) has any length, ``reach`` is that of the settled point, ``ahead`` (2,) the unit heading.
        """
        if self._began is None and reach > FAR and fall @ ahead > AHEAD * np.linalg.norm(fall):
            self._began = time

    def reset(self) -> None:
        """Forget the swing, so that another can begin."""
        self._began = None

    def wish(self, state: DynamicsState, time: float) -> tuple[FloatArray, float] | None:
        """Wanted accelerations (k,) of the joints [rad/s^2] at a time [s] and their weight, or None."""
        since = np.inf if self._began is None else time - self._began
        if since >= SWUNG:
            return None
        angles = (UP, SIDEWAYS if since < APART else 0.0, BENT) if since < RAISED else (DOWN, CLEAR, 0.0)
        error = np.repeat(angles, self._arms) - state.q[7 + self.joints]
        pull = PULL.stiffness * error - PULL.damping * state.v[6 + self.joints]
        return pull, RAISING if since < RAISED else SWINGING


FORCE_WEIGHT = 1e-5
"""Regularisation of the forces at the corners [1/N^2]: shares the load between the feet."""


@dataclass(frozen=True, eq=False)
class Objective:
    """What one step minimises.

    ``sum weight (theta'' - wanted)^2 + com_weight (s'' - law)^2 - upward s''_z``, half of each square.

    Attributes:
        weight: (nv - 6,) diagonal of ``C_theta`` ([Kudoh2002]_ 2.27).
        wanted: (nv - 6,) joint accelerations from which the objective is measured [rad/s^2].
        law: (3,) wanted acceleration of the centre of mass [m/s^2].
        com_weight: (3,) of its squared error; 0 leaves it free.
        upward: Slope of the upward acceleration.
        tasks: Further squares, of generalised accelerations.
    """

    weight: FloatArray
    wanted: FloatArray
    law: FloatArray
    com_weight: FloatArray = field(default_factory=lambda: np.zeros(3))
    upward: float = 0.0
    tasks: tuple[AccelerationTask, ...] = ()


@dataclass(frozen=True, eq=False)
class RecoveryProblem:
    """The quadratic program of one step with the meaning of its variables.

    Attributes:
        program: On ``x = [phi'' (k,), forces at the corners]``.
        loop: Maps of ``phi''``.
        torque: (nv - 6,) joint torques, linear in ``x`` [N.m].
        relaxable: First and last (exclusive) row that may be left out when there is no solution: the stops
            of the joints and the symmetry of the legs.
    """

    program: QuadraticProgram
    loop: ClosedLoop
    torque: LinearMap
    relaxable: tuple[int, int]

    def relaxed(self) -> QuadraticProgram:
        """The program without the stops of the joints and the symmetry of the legs."""
        return self._without(slice(*self.relaxable))

    def loose(self) -> QuadraticProgram:
        """The program with the torque limits alone: the ground may pull, the ZMP may be anywhere."""
        program = self._without(slice(6 + len(self.torque.offset), self.relaxable[1]))
        return replace(program, lower=np.full_like(program.lower, -np.inf))

    def _without(self, rows: slice) -> QuadraticProgram:
        lower, upper = self.program.rows_lower.copy(), self.program.rows_upper.copy()
        lower[rows], upper[rows] = -np.inf, np.inf
        return replace(self.program, rows_lower=lower, rows_upper=upper)


def build_recovery_qp(
    state: DynamicsState, loop: ClosedLoop, contacts: Sequence[ContactForceBasis], push: FeltPush,
    bounds: JointBounds, zmp: LinearMap, symmetry: LinearMap, objective: Objective, *, pulling: bool = False,
) -> RecoveryProblem:  # fmt: skip
    """Build the program of one step.

    Args:
        contacts: Force maps of the feet.
        push: What pushes besides the ground.
        bounds: Torque limits and the stops of the joints ([Kudoh2002]_ 2.55-2.56).
        zmp: Rows that are not positive when the ZMP is inside (2.57-2.60).
        symmetry: Rows that are not positive when the legs grow no less alike (2.63-2.64).
        pulling: Whether the ground may pull as well.
    """
    generalised = np.concatenate([basis.generalised for basis in contacts], axis=1)
    basis, drift = loop.acceleration.matrix, loop.acceleration.offset
    motion = np.concatenate((state.mass_matrix @ basis, -generalised), axis=1)
    still = state.mass_matrix @ drift + state.bias - push.generalised
    torque, size, forces = LinearMap(motion[6:], still[6:]), motion.shape[1], generalised.shape[1]
    moves = np.concatenate((zmp.matrix, loop.joints.matrix, symmetry.matrix))
    rows = np.concatenate((motion, np.pad(moves, ((0, 0), (0, forces)))))
    lower = np.concatenate((
        -still[:6], bounds.torque_lower - still[6:], np.full(len(zmp.offset), -np.inf),
        bounds.acceleration_lower - loop.joints.offset, np.full(len(symmetry.offset), -np.inf),
    ))  # fmt: skip
    upper = np.concatenate((
        -still[:6], bounds.torque_upper - still[6:], -zmp.offset,
        bounds.acceleration_upper - loop.joints.offset, -symmetry.offset,
    ))  # fmt: skip
    least = np.concatenate((np.full(loop.size, -np.inf), np.full(forces, -np.inf if pulling else 0.0)))
    hessian, gradient = _cost(loop, objective, size)
    program = QuadraticProgram(hessian, gradient, rows, lower, upper, least, np.full(size, np.inf), 6)
    return RecoveryProblem(program, loop, torque, (len(motion) + len(zmp.offset), len(rows)))


def leg_symmetry(
    loop: ClosedLoop, angles: FloatArray, pairs: Sequence[tuple[int, int]], tolerance: float
) -> LinearMap:
    """Rows that let no pair of joints grow less alike ([Kudoh2002]_ 2.49-2.53).

    Where the right angle is the larger one its acceleration is at most the left one's, and the other way
    round (the print has lost the signs of one of the two branches). Of the angles (nv - 6,) [rad], those of
    a pair, left and right, that differ by less than the tolerance [rad] count as equal: the pair is free.
    """
    rows, offsets = [], []
    for left, right in pairs:
        gap = angles[right] - angles[left]
        if abs(gap) > tolerance:
            sign = np.sign(gap)
            rows.append(sign * (loop.joints.matrix[right] - loop.joints.matrix[left]))
            offsets.append(sign * (loop.joints.offset[right] - loop.joints.offset[left]))
    return LinearMap(np.array(rows).reshape(-1, loop.size), np.array(offsets))


def _cost(loop: ClosedLoop, objective: Objective, size: int) -> tuple[FloatArray, FloatArray]:
    k = loop.size
    weighted = loop.joints.matrix * objective.weight[:, None]
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    hessian[:k, :k] = weighted.T @ loop.joints.matrix
    gradient[:k] = (loop.joints.offset - objective.wanted) @ weighted
    pulled = loop.com.matrix * objective.com_weight[:, None]
    hessian[:k, :k] += pulled.T @ loop.com.matrix
    gradient[:k] += (loop.com.offset - objective.law) @ pulled
    gradient[:k] -= objective.upward * loop.com.matrix[2]
    for task in objective.tasks:
        moved = task.matrix @ loop.acceleration.matrix
        weighted = moved * task.weight[:, None]
        hessian[:k, :k] += weighted.T @ moved
        gradient[:k] += (task.matrix @ loop.acceleration.offset - task.target) @ weighted
    hessian[np.arange(k, size), np.arange(k, size)] = FORCE_WEIGHT
    return hessian, gradient


FIRM = 100.0
"""Weight of joints that hold an angle, against 1 of those that need not."""

STEPPING_JOINTS = 0.1
"""Weight of the joints while a foot steps."""

ROOT = "pelvis"
"""Effector that is kept upright while a foot steps."""


class Objectives:
    """The objectives of a body, of which some joints may be locked."""

    def __init__(
        self, settings: RecoverySettings, groups: JointGroups, arms: ArmSwing, upright: EffectorReference
    ) -> None:
        """Keep weights, joints, the swing of the arms, and how the pelvis is kept while a foot steps."""
        self._settings, self._groups, self._arms, self._upright = settings, groups, arms, upright
        self._locked = groups.locked(settings.locked)

    def held(self, state: DynamicsState, posture: FloatArray, wanted: FloatArray) -> Objective:
        """Joint accelerations as wanted, and of locked joints what holds them."""
        weight = np.full(len(wanted), FIRM)
        return Objective(weight, self._with_locked(state, posture, wanted, weight), np.zeros(3))

    def balancing(self, state: DynamicsState, posture: FloatArray, law: ComLaw, time: float) -> Objective:
        """The objective of the quadratic program (2.54) with the law of the centre of mass."""
        settings, weight = self._settings, np.ones(len(posture))
        weight[self._groups.joints["arm"]] = settings.arm_weight
        weight[self._groups.joints["trunk"]] = settings.trunk_weight
        gains = settings.unwinding
        damping = gains.damping + (1.0 - law.need) * settings.stopping
        wanted = pull(Impedance(gains.stiffness, damping), state, posture)
        swing = self._arms.wish(state, time)
        if swing is not None:
            wanted[self._arms.joints], weight[self._arms.joints] = swing
        wanted = self._with_locked(state, posture, wanted, weight)
        return Objective(weight, wanted, law.acceleration, self._com_weight, settings.upward)

    def stepping(
        self, state: DynamicsState, posture: FloatArray, law: ComLaw, foot: str, way: EffectorReference
    ) -> Objective:
        """A foot follows its way, the trunk stays upright and the centre of mass keeps its law."""
        settings, firmness = self._settings, self._settings.swing_weight
        weight = np.full(len(posture), STEPPING_JOINTS)
        joints = self._with_locked(state, posture, pull(settings.posture, state, posture), weight)
        swing = swing_task(foot, state.frames[foot], way, settings.swing, firmness)
        upright = orientation_task(ROOT, state.frames[ROOT], self._upright, settings.posture, firmness)
        return Objective(weight, joints, law.acceleration, self._com_weight, tasks=(swing, upright))

    @property
    def _com_weight(self) -> FloatArray:
        settings = self._settings
        return np.array([settings.com_weight, settings.com_weight, settings.height_weight])

    def _with_locked(
        self, state: DynamicsState, posture: FloatArray, wanted: FloatArray, weight: FloatArray
    ) -> FloatArray:
        """Wanted accelerations with those that hold the locked joints; their weights are set."""
        result = wanted.copy()
        result[self._locked] = pull(self._settings.stiffness, state, posture)[self._locked]
        weight[self._locked] = FIRM * 10.0
        return result


def pull(gains: Impedance, state: DynamicsState, posture: FloatArray) -> FloatArray:
    """(nv - 6,) joint accelerations back to a posture (nv - 6,) [rad/s^2]."""
    return gains.stiffness * (posture - state.q[7:]) - gains.damping * state.v[6:]
