"""A running simulation: state, joint torques, pushes, grips and contact forces."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body.strength import with_masses
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, cross
from manikin.simulation.carrying import CarriedPoints, Sensed, Touch
from manikin.simulation.compile import SimulationModel, compile_model, obstacle_of, root_rotation
from manikin.simulation.push_force import Push

_NOTHING = (np.zeros((0, 2), dtype=int), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
"""Contacts that carry in a step without any: geometries, points, normals, forces, friction."""

_INERTIAL = (
    "body_mass", "body_ipos", "body_iquat", "body_inertia", "body_subtreemass", "body_invweight0", "dof_M0",
    "dof_invweight0", "actuator_acc0",
)  # fmt: skip
"""Arrays of the engine's model that depend on the masses."""


@dataclass(frozen=True, eq=False)
class Grip:
    """A hand's hold on a point of the scene: a stiff, damped spring of limited force.

    It stands for a grasp by fingers, and saturates (the hand slips) where too much is asked of it. Plans
    take every contact as rigid, so that a grip is as stiff as the other contacts, see :meth:`of_mass`.

    Attributes:
        effector: Name of the gripping effector.
        position: (3,) where it holds on [m].
        max_force: Limit along each world axis [N].
        stiffness: Stiffness of the spring [N/m].
        damping: Damping of the spring [N.s/m].
    """

    effector: str
    position: FloatArray
    max_force: float
    stiffness: float = 6e4
    damping: float = 370.0

    @classmethod
    def of_mass(
        cls, effector: str, position: FloatArray, max_force: float, mass: float, time: float
    ) -> "Grip":
        """Critically damped grip with the time constant of the other contacts [s], ``T``.

        With the least mass ``m`` of the hand against the scene [kg] (:meth:`World.least_mass`), about 0.6 kg
        of a man of 79 kg and 0.3 kg of a woman of 52 kg, its stiffness is ``m / T^2`` and its damping ``2 m /
        T``: with 3 ms it gives way by 3 mm under 200 N, or 6 mm.  Stiffer than for its mass, a hand rings.
        """
        return cls(effector, position, max_force, mass / time**2, 2.0 * mass / time)


class World:
    """The physics engine with a body in a scene; states go in and come out in Pinocchio's convention.

    Attributes:
        model: The compiled body and scene.
        penetration: Deepest penetration of any contact since the last reset, paddings apart [m].
        padding_compression: Deepest penetration of a padding since the last reset [m].
    """

    def __init__(self, model: SimulationModel, padded: Sequence[str] = ()) -> None:
        """Make a world at rest in the zero configuration; the padded obstacles give way."""
        self.model = model
        self._model = copy.copy(model.mujoco)
        self._data = mujoco.MjData(self._model)
        self._before = (self._data.qpos.copy(), self._data.qvel.copy(), 0.0)
        # Segment or obstacle that each geometry belongs to, and whether it is a segment.
        names = [(name, obstacle_of(name)) for name in model.geom_names]
        self._owners = [(obstacle or name.split("/")[0], obstacle is None) for name, obstacle in names]
        self._segments = frozenset(segment.name for segment in model.body.segments)
        self._planned = np.zeros((self._model.ngeom, self._model.ngeom), dtype=bool)
        self._leaning, self._leans = np.zeros_like(self._planned), False
        self._padded = np.array([name in padded and not segment for name, segment in self._owners])
        self._pads = bool(self._padded.any())
        self._masks: dict[tuple[tuple[str, ...], bool], NDArray[np.bool_]] = {}
        self._tables: dict[tuple[tuple[str, ...], str], NDArray[np.bool_]] = {}
        self._pushes: list[Push] = []
        self._load: dict[str, float] = {}
        self._grips: dict[str, Grip] = {}
        self._grip_forces: dict[str, FloatArray] = {}
        self._touches: dict[tuple[str, str], Touch] = {}
        self.penetration, self.padding_compression = 0.0, 0.0
        self._total, self._steps = np.zeros(6), 0
        self._carried: list[tuple[NDArray, ...]] = []
        self._is_segment = np.array([segment for _, segment in self._owners], dtype=bool)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._data.time)

    @property
    def q(self) -> FloatArray:
        """(nq,) configuration."""
        return self.model.q_from_mujoco(self._data.qpos)

    @property
    def v(self) -> FloatArray:
        """(nv,) velocity."""
        return self.model.v_from_mujoco(self._data.qpos, self._data.qvel)

    def reset(self, q: ArrayLike, v: ArrayLike | None = None, time: float = 0.0) -> None:
        """Put the body into a state, at rest without ``v``, at a time [s]; only pushes and grips stay."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.time = time
        self.model.set_state(self._data, q, v)
        self._before = (self._data.qpos.copy(), self._data.qvel.copy(), time)
        self._grip_forces.clear()
        self.forget()

    def forget(self) -> None:
        """Forget unplanned touches, the deepest penetrations and the wrenches so far."""
        self._touches.clear()
        self.penetration, self.padding_compression = 0.0, 0.0
        self._total[:], self._steps = 0.0, 0
        self._carried.clear()

    def carry(self, masses: Mapping[str, float]) -> None:
        """Set the point masses that effectors carry, at rest in their frames [kg]; none sets all down."""
        if masses == self._load:
            return
        model = self.model
        loaded = compile_model(with_masses(model.body, masses), model.scene, model.options).mujoco
        for name in _INERTIAL:
            getattr(self._model, name)[:] = getattr(loaded, name)
        self._load = dict(masses)

    def apply_push(self, push: Push) -> None:
        """Push a segment; one that the body does not have is a BodyError."""
        self.model.body_id(push.segment)
        self._pushes.append(push)

    def least_mass(self, effector: str) -> float:
        """Least mass of an effector against a push here, ``1 / max eig(J M^-1 J^T)`` [kg]."""
        jacobian = np.zeros((3, self._model.nv))
        mujoco.mj_forward(self._model, self._data)
        mujoco.mj_jacSite(self._model, self._data, jacobian, None, self.model.site_id(effector))
        moved = np.zeros_like(jacobian)
        mujoco.mj_solveM(self._model, self._data, moved, jacobian)
        return 1.0 / float(np.linalg.eigvalsh(jacobian @ moved.T)[-1])

    def grip(self, grip: Grip) -> None:
        """Let an effector hold on; replaces what it held.

        The gripping segment does not collide with the scene meanwhile: the grip stands for all contact.
        """
        self.model.site_id(grip.effector)
        self._grips[grip.effector] = grip
        self.collide(grip.effector, False)

    def release(self, effector: str) -> None:
        """Let go; nothing happens where nothing was held."""
        if self._grips.pop(effector, None) is not None:
            self._grip_forces.pop(effector, None)
            self.collide(effector, True)

    def collide(self, effector: str, enabled: bool) -> None:
        """Let the segment of an effector, such as a hand about to grasp, collide with obstacles or not."""
        mask = self._mask((self.model.body.effector(effector).segment,), True)
        bits, affinity = self.model.mujoco.geom_contype[mask], self.model.mujoco.geom_conaffinity[mask]
        # Obstacles do not answer to the bit 4; segments do through their affinity.
        self._model.geom_contype[mask] = bits if enabled else 4
        self._model.geom_conaffinity[mask] = affinity if enabled else affinity & 1

    def plan_touches(
        self, pairs: Sequence[tuple[Sequence[str], str]], leaning: Sequence[tuple[Sequence[str], str]] = ()
    ) -> None:
        """Set which touches are planned from now on; all others are reported.

        Pairs are of segments and the obstacle that they are supported by, or that they may lean on besides.

        Raises:
            InputError: If an obstacle is not in the scene.
        """
        self._planned = self._touching(pairs)
        self._leaning = self._touching(leaning) & ~self._planned
        self._leans = bool(self._leaning.any())
        self._planned |= self._leaning

    def _touching(self, pairs: Sequence[tuple[Sequence[str], str]]) -> NDArray[np.bool_]:
        """(geometries, geometries) whether two geometries are a segment and the obstacle of a pair."""
        touching = np.zeros_like(self._planned)
        for segments, obstacle in pairs:
            if not self._mask((obstacle,), False).any():
                names = sorted({name for name, segment in self._owners if not segment})
                raise InputError(f"planned touch of obstacle {obstacle!r}; valid: one of {names}")
            touching |= self._table(tuple(segments), obstacle)
        return touching

    def advance(self, tau: ArrayLike, steps: int = 1) -> None:
        """Hold joint torques (nv - 6,) [N.m] for a number of engine steps."""
        self._data.ctrl[:] = tau
        for _ in range(steps):
            self._before = (self._data.qpos.copy(), self._data.qvel.copy(), self.time)
            self._act()
            mujoco.mj_step(self._model, self._data)
            self._note_contacts()
            wrench = self._constraint_wrench()
            self._total += wrench - self._leaning_wrench() if self._leans else wrench
            self._steps += 1

    def mean_wrench(self) -> FloatArray:
        """(6,) mean wrench of scene and grips on the body since the last call, about the world origin.

        Where the body only leans, nothing counts: it acts like a push. Impacts count by their share of time.
        """
        mean = self._total / max(self._steps, 1)
        self._total[:], self._steps = 0.0, 0
        return mean

    def carried(self) -> CarriedPoints:
        """Contact points of body and scene that carried force since the last call, but where it only leans.

        A point counts as often as it was met, each time with its force over the number of engine steps.
        """
        steps, self._carried = self._carried or [_NOTHING], []
        geoms, positions, normals, forces, friction = map(np.concatenate, zip(*steps, strict=True))
        second = self._is_segment[geoms[:, 1]]
        own, other = np.where(second, geoms[:, ::-1].T, geoms.T).tolist()
        # The engine's normal goes from the first geometry to the second.
        normals = np.where(second, 1.0, -1.0)[:, None] * normals
        names, others = (tuple(self._owners[geom][0] for geom in side) for side in (own, other))
        return CarriedPoints(names, others, positions, normals, forces / len(steps), friction)

    def _constraint_wrench(self) -> FloatArray:
        """Wrench of all contacts and grips in the last step; inner forces cancel in the root."""
        qpos, _, _ = self._before
        force, local = self._data.qfrc_constraint[:3], self._data.qfrc_constraint[3:6]
        moment = root_rotation(self.model.q_from_mujoco(qpos)) @ local
        total = np.concatenate((force, cross(qpos[:3], force) + moment))
        for pull, position in self._grip_forces.values():
            total += np.concatenate((pull, cross(position, pull)))
        return total

    def _leaning_wrench(self) -> FloatArray:
        """Wrench of the contacts of the last step in which the body only leans on something."""
        total, local = np.zeros(6), np.zeros(6)
        geoms = self._data.contact.geom
        for number in np.flatnonzero(self._leaning[geoms[:, 0], geoms[:, 1]]):
            mujoco.mj_contactForce(self._model, self._data, number, local)
            *_, swapped = self._parties(*(int(geom) for geom in geoms[number]))
            force = local[:3] @ self._data.contact.frame[number].reshape(3, 3) * (-1.0 if swapped else 1.0)
            total += np.concatenate((force, cross(self._data.contact.pos[number], force)))
        return total

    def _act(self) -> None:
        self._data.xfrc_applied[:] = 0.0
        for push in self._pushes:
            if push.active(self.time):
                number, force = self.model.body_id(push.segment), push.at(self.time)
                self._data.xfrc_applied[number, :3] += force
                if push.point is not None:
                    turned = self._data.xmat[number].reshape(3, 3) @ push.point
                    arm = self._data.xpos[number] + turned - self._data.xipos[number]
                    self._data.xfrc_applied[number, 3:] += cross(arm, force)
        for grip in self._grips.values():
            self._hold(grip)

    def _hold(self, grip: Grip) -> None:
        site = self.model.site_id(grip.effector)
        body = int(self._model.site_bodyid[site])
        position = self._data.site_xpos[site].copy()
        twist = np.empty(6)
        mujoco.mj_objectVelocity(self._model, self._data, mujoco.mjtObj.mjOBJ_SITE, site, twist, 0)
        force = grip.stiffness * (grip.position - position) - grip.damping * twist[3:]
        force = np.clip(force, -grip.max_force, grip.max_force)
        self._data.xfrc_applied[body, :3] += force
        self._data.xfrc_applied[body, 3:] += cross(position - self._data.xipos[body], force)
        self._grip_forces[grip.effector] = np.stack((force, position))

    def _note_contacts(self) -> None:
        if self._data.ncon == 0:
            self._carried.append(_NOTHING)
            return
        contact = self._data.contact
        geoms, depths, forces = contact.geom, -contact.dist, np.zeros(self._data.ncon)
        if self._data.nefc:
            first = contact.efc_address
            forces = np.where(first >= 0, self._data.efc_force[np.maximum(first, 0)], 0.0)
        carries = (self._is_segment[geoms[:, 0]] != self._is_segment[geoms[:, 1]]) & (forces > 0.0)
        carries &= ~self._leaning[geoms[:, 0], geoms[:, 1]]
        self._carried.append((
            geoms[carries], contact.pos[carries], contact.frame[carries, :3], forces[carries],
            contact.friction[carries, 0],
        ))  # fmt: skip
        if self._pads:
            padded = self._padded[geoms].any(axis=1)
            self.padding_compression = max(self.padding_compression, float(depths[padded].max(initial=0.0)))
            depths = depths[~padded]
        self.penetration = max(self.penetration, float(depths.max(initial=0.0)))
        planned = self._planned[geoms[:, 0], geoms[:, 1]]
        pressed: dict[tuple[str, str], float] = {}
        for (first, second), force in zip(geoms[~planned], forces[~planned], strict=True):
            segment, other, _ = self._parties(int(first), int(second))
            pressed[segment, other] = pressed.get((segment, other), 0.0) + float(force)
        for pair, force in pressed.items():
            known = self._touches.get(pair, Touch(self._before[2], *pair))
            self._touches[pair] = replace(known, force=max(known.force, force))

    def touching(self, segments: Sequence[str], obstacle: str) -> bool:
        """Whether one of the segments was in contact with the obstacle in the last engine step."""
        geoms = self._data.contact.geom
        return bool(self._table(tuple(segments), obstacle)[geoms[:, 0], geoms[:, 1]].any())

    def _table(self, segments: tuple[str, ...], obstacle: str) -> NDArray[np.bool_]:
        """(geometries, geometries) whether two geometries are one of the segments and the obstacle."""
        if (segments, obstacle) not in self._tables:
            body, scene = self._mask(segments, True), self._mask((obstacle,), False)
            self._tables[segments, obstacle] = np.outer(body, scene) | np.outer(scene, body)
        return self._tables[segments, obstacle]

    def _mask(self, names: tuple[str, ...], segments: bool) -> NDArray[np.bool_]:
        if (names, segments) not in self._masks:
            self._masks[names, segments] = np.array(
                [name in names and is_segment == segments for name, is_segment in self._owners]
            )
        return self._masks[names, segments]

    def sense(self) -> Sensed:
        """Return accelerations and contact forces of the last engine step."""
        qpos, qvel, time = self._before
        contact = self._data.contact
        parties = [self._parties(first, second) for first, second in contact.geom.tolist()]
        # The engine's contact frame has x from the first geometry to the second, on which its force acts.
        sign = np.array([-1.0 if swapped else 1.0 for *_, swapped in parties]).reshape(-1, 1)
        frames, forces = np.array(contact.frame).reshape(-1, 3, 3), np.zeros((self._data.ncon, 6))
        for number, force in enumerate(forces):
            mujoco.mj_contactForce(self._model, self._data, number, force)
        return Sensed(
            time, self.model.a_from_mujoco(qpos, qvel, self._data.qacc),
            segments=tuple(segment for segment, _, _ in parties),
            others=tuple(other for _, other, _ in parties),
            on_scene=np.array([other not in self._segments for _, other, _ in parties], dtype=bool),
            positions=np.array(contact.pos).reshape(-1, 3), normals=sign * frames[:, 0],
            forces=sign * np.einsum("ki,kij->kj", forces[:, :3], frames),
            depths=-np.array(contact.dist).reshape(-1), grips=dict(self._grip_forces),
        )  # fmt: skip

    def _parties(self, first: int, second: int) -> tuple[str, str, bool]:
        """Segment, other party, and whether the segment is the engine's first geometry."""
        swapped = not self._owners[second][1]
        if swapped:
            first, second = second, first
        return self._owners[second][0], self._owners[first][0], swapped

    @property
    def touches(self) -> tuple[Touch, ...]:
        """Touches that were not planned since the last reset, in order of their first time."""
        return tuple(self._touches.values())

    @property
    def divergence(self) -> str:
        """Fatal warning of the engine, such as ``"BADQACC"``; empty without one."""
        kinds, number = ("BADQPOS", "BADQVEL", "BADQACC", "BADCTRL"), mujoco.mjtWarning
        told = (kind for kind in kinds if self._data.warning[getattr(number, f"mjWARN_{kind}")].number)
        return next(told, "")
