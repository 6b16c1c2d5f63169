"""A running simulation: state, joint torques, pushes, grips and contact forces."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body.strength import with_masses
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, cross
from manikin.simulation.carrying import CarriedPoints, EngineStep, Sensed, Touch
from manikin.simulation.compile import SimulationModel, compile_model, obstacle_of
from manikin.simulation.push_force import Push

_WRENCH = ("root", "rotation", "force", "others")
_POINTS = ("geoms", "positions", "frames", "friction", "forces", "leant")
"""What of engine steps makes wrenches, and the points that carried them."""

_AXES = np.arange(3)

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


_FATAL = {
    kind: int(getattr(mujoco.mjtWarning, f"mjWARN_{kind}"))
    for kind in ("BADQPOS", "BADQVEL", "BADQACC", "BADCTRL")
}
"""Warnings of the engine after which its state means nothing."""


class World:
    """The physics engine with a body in a scene; states go in and come out in Pinocchio's convention.

    Engine steps are kept as they are and measured together, when something is asked about them.

    Attributes:
        model: The compiled body and scene.
    """

    def __init__(self, model: SimulationModel, padded: Sequence[str] = ()) -> None:
        """Make a world at rest in the zero configuration; the padded obstacles give way."""
        self.model = model
        self._model = copy.copy(model.mujoco)
        self._root = model.body_id(model.body.segments[0].name)
        self._data = mujoco.MjData(self._model)
        self._before = (self._data.qpos.copy(), self._data.qvel.copy(), 0.0)
        # Segment or obstacle that each geometry belongs to, and whether it is a segment.
        names = [(name, obstacle_of(name)) for name in model.geom_names]
        self._owners = [(obstacle or name.split("/")[0], obstacle is None) for name, obstacle in names]
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
        self._penetration, self._padding_compression = 0.0, 0.0
        self._unmeasured: list[EngineStep] = []
        self._untaken: list[EngineStep] = []
        self._is_segment = np.array([segment for _, segment in self._owners], dtype=bool)
        self._names = np.array([name for name, _ in self._owners], dtype=object)

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
        self._unmeasured.clear()
        self._untaken.clear()
        self._touches.clear()
        self._penetration, self._padding_compression = 0.0, 0.0

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
        self._measure()
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
            step = self._kept()
            self._unmeasured.append(step)
            self._untaken.append(step)

    def take(self) -> tuple[EngineStep, ...]:
        """The engine steps since the last call."""
        taken, self._untaken = tuple(self._untaken), []
        return taken

    def mean_wrench(self) -> FloatArray:
        """(6,) mean wrench of the engine steps that :meth:`take` would give, as of :meth:`loads`."""
        return self.loads([self.take()])[0][0]

    def carried(self) -> CarriedPoints:
        """Contact points that carried force in the engine steps that :meth:`take` would give."""
        return self.loads([self.take()])[1][0]

    def loads(self, spans: Sequence[Sequence[EngineStep]]) -> tuple[FloatArray, list[CarriedPoints]]:
        """What carried the body in n spans of engine steps.

        Where it only leans, nothing counts: it acts like a push. Impacts count by their share of time.

        Returns:
            (n, 6) mean wrenches of scene and grips on the body about the world origin, and for each span the
            contact points of body and scene that carried force: a point counts as often as it was met, each
            time with its force over the number of engine steps.
        """
        steps, lengths = [step for span in spans for step in span], np.array([len(span) for span in spans])
        wrenches, lengths = np.zeros((len(spans), 6)), np.maximum(lengths, 1)
        if not steps:
            return wrenches, [CarriedPoints.none() for _ in spans]
        owner = np.repeat(np.arange(len(spans)), [len(span) for span in spans])
        roots, turns, forces, others = (np.array([getattr(s, key) for s in steps]) for key in _WRENCH)
        force, moment = forces[:, :3], np.einsum("sij,sj->si", turns.reshape(-1, 3, 3), forces[:, 3:])
        # Inner forces cancel in the root.
        np.add.at(wrenches, owner, np.hstack([force, cross(roots, force) + moment]) + others)
        if any(step.leant.any() for step in steps):
            number, _, places, pushes = self.scene_forces(steps, leant=True)
            np.subtract.at(wrenches, owner[number], np.hstack([pushes, cross(places, pushes)]))
        geoms, positions, frames, friction, forces, leant = (
            np.concatenate([getattr(step, key) for step in steps]) for key in _POINTS
        )
        own, other, sign = self._sides(geoms)
        carries = np.flatnonzero(~self._is_segment[other] & ~leant & (forces[:, 0] > 0.0))
        span = np.repeat(owner, [len(step.geoms) for step in steps])[carries]
        own, other = self._names[own[carries]].tolist(), self._names[other[carries]].tolist()
        positions, friction = positions[carries], friction[carries]
        normals, pressing = sign[carries] * frames[carries, :3], forces[carries, 0] / lengths[span]
        ends = np.searchsorted(span, np.arange(len(spans) + 1)).tolist()
        carried = [
            CarriedPoints(tuple(own[a:b]), tuple(other[a:b]), positions[a:b], normals[a:b], pressing[a:b],
                          friction[a:b])
            for a, b in pairwise(ends)
        ]  # fmt: skip
        return wrenches / lengths[:, None], carried

    def accelerations(self, steps: Sequence[EngineStep]) -> FloatArray:
        """(n, nv) generalised accelerations in n engine steps [m/s^2, rad/s^2]."""
        a = np.array([step.qacc for step in steps])
        to_root = np.array([step.rotation for step in steps]).reshape(-1, 3, 3).transpose(0, 2, 1)
        speeds = np.array([step.qvel[:6] for step in steps])
        linear, acceleration = (np.einsum("sij,sj->si", to_root, one[:, :3]) for one in (speeds, a))
        a[:, :3] = acceleration - cross(speeds[:, 3:], linear)
        return a

    def scene_forces(
        self, steps: Sequence[EngineStep], *, leant: bool = False
    ) -> tuple[NDArray[np.int64], NDArray[np.object_], FloatArray, FloatArray]:
        """Contact points of body and scene in some engine steps, or only those on which it leans.

        Returns:
            (k,) step of each, (k,) its segment, (k, 3) its place [m], (k, 3) the force there [N].
        """
        geoms, positions, frames, leans, forces = (
            np.concatenate([getattr(step, key) for step in steps])
            for key in ("geoms", "positions", "frames", "leant", "forces")
        )
        own, other, sign = self._sides(geoms)
        chosen = np.flatnonzero(leans if leant else ~self._is_segment[other])
        owner = np.repeat(np.arange(len(steps)), [len(step.geoms) for step in steps])
        forces = sign * np.einsum("ki,kij->kj", forces, frames.reshape(-1, 3, 3))
        return owner[chosen], self._names[own[chosen]], positions[chosen], forces[chosen]

    def _sides(
        self, geoms: NDArray[np.int32]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
        """(k,) geometry of the body and (k,) the other one of pairs (k, 2); (k, 1) sign of what acts on it.

        The engine's contact frame has x from the first geometry to the second, on which its force acts.
        """
        ours = self._is_segment[geoms[:, 1]]
        own, other = np.where(ours, geoms.T[::-1], geoms.T)
        return own, other, np.where(ours, 1.0, -1.0)[:, None]

    @property
    def penetration(self) -> float:
        """Deepest penetration of any contact since the last reset, paddings apart [m]."""
        self._measure()
        return self._penetration

    @property
    def padding_compression(self) -> float:
        """Deepest penetration of a padding since the last reset [m]."""
        self._measure()
        return self._padding_compression

    def _kept(self) -> EngineStep:
        """Copy of what was measured in the engine step that was just made."""
        data, contact, (qpos, qvel, time) = self._data, self._data.contact, self._before
        geoms, first, others = contact.geom.copy(), contact.efc_address, np.zeros(6)
        for pull, position in self._grip_forces.values():
            others += np.concatenate((pull, cross(position, pull)))
        forces, leant = np.zeros((len(geoms), 3)), np.zeros(len(geoms), dtype=bool)
        if data.nefc:
            acts = first >= 0
            forces[acts] = data.efc_force[first[acts, None] + _AXES]
        if self._leans:
            leant = self._leaning[geoms[:, 0], geoms[:, 1]]
        return EngineStep(
            time, qpos[:3], qvel, data.qacc.copy(), data.xmat[self._root].copy(),
            data.qfrc_constraint[:6].copy(), others, dict(self._grip_forces), geoms, -contact.dist,
            contact.pos.copy(), contact.frame.copy(), contact.friction[:, 0].copy(), forces, leant,
        )  # fmt: skip

    def _measure(self) -> None:
        """Take the engine steps since the last call into the touches and penetrations."""
        steps, self._unmeasured = self._unmeasured, []
        if not steps:
            return
        geoms, depths, forces = (
            np.concatenate([getattr(step, key) for step in steps]) for key in ("geoms", "depths", "forces")
        )
        unplanned = np.flatnonzero(~self._planned[geoms[:, 0], geoms[:, 1]])
        if len(unplanned):
            times = np.repeat([step.time for step in steps], [len(step.geoms) for step in steps])
            self._note_touches(times[unplanned], geoms[unplanned], forces[unplanned, 0])
        if self._pads:
            padded = self._padded[geoms].any(axis=1)
            deepest = float(depths[padded].max(initial=0.0))
            self._padding_compression = max(self._padding_compression, deepest)
            depths = depths[~padded]
        self._penetration = max(self._penetration, float(depths.max(initial=0.0)))

    def _note_touches(self, times: FloatArray, geoms: NDArray[np.int32], forces: FloatArray) -> None:
        """Remember unplanned contact points at times [s] with their normal forces [N]."""
        pressed: dict[tuple[float, str, str], float] = {}
        for time, (first, second), force in zip(times.tolist(), geoms.tolist(), forces.tolist(), strict=True):
            key = time, *self._parties(first, second)[:2]
            pressed[key] = pressed.get(key, 0.0) + force
        for (time, segment, other), force in pressed.items():
            known = self._touches.get((segment, other), Touch(time, segment, other))
            self._touches[segment, other] = replace(known, force=max(known.force, force))

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

    def touching(self, segments: tuple[str, ...], obstacle: str) -> bool:
        """Whether one of the segments was in contact with the obstacle in the last engine step."""
        first, second = self._data.contact.geom.T
        return bool(self._table(segments, obstacle)[first, second].any())

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
        step = self._kept()
        own, other, sign = self._sides(step.geoms)
        frames = step.frames.reshape(-1, 3, 3)
        return Sensed(
            step.time, self.accelerations([step])[0], segments=tuple(self._names[own].tolist()),
            others=tuple(self._names[other].tolist()), on_scene=~self._is_segment[other],
            positions=step.positions, normals=sign * frames[:, 0],
            forces=sign * np.einsum("ki,kij->kj", step.forces, frames), depths=step.depths, grips=step.grips,
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
        self._measure()
        return tuple(self._touches.values())

    @property
    def divergence(self) -> str:
        """Fatal warning of the engine, such as ``"BADQACC"``; empty without one."""
        warnings = self._data.warning
        return next((kind for kind, number in _FATAL.items() if warnings[number].number), "")
