"""A whole-body motion sampled in time, with its contacts, forces and margin, and what follows from it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import compress
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.errors import MotionFileError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.runtime.display import Displayed

if TYPE_CHECKING:
    from pandas import DataFrame


LIFT = 0.08
"""Largest distance from the surfaces in flight [m]."""


def foot_positions(schedule: ContactSchedule, times: FloatArray) -> dict[str, FloatArray]:
    """(n, 3) position of every effector of a schedule [m].

    In flight a foot follows the straight line to its next contact with the smootherstep of time, lifted along
    the mean of both normals by ``LIFT sin^2(pi u)``. Before its first contact and after its last it waits.
    """
    positions, phases, swings = {}, schedule.phase_at(times), schedule.sequence.swings()
    for name in schedule.sequence.effectors:
        path = np.empty((len(times), 3))
        for number, phase in enumerate(schedule.sequence):
            if name in phase.stance:
                path[phases == number] = phase.stance[name].position
        for swing in (item for item in swings if item.effector == name):
            inside = (phases >= swing.first_phase) & (phases <= swing.last_phase)
            first, last = swing.start or swing.end, swing.end or swing.start
            if first is None or last is None:
                continue
            begin, end = schedule.swing_interval(swing)
            u = np.clip((times[inside] - begin) / (end - begin), 0.0, 1.0)[:, None]
            line = first.position + u**3 * (u * (6.0 * u - 15.0) + 10.0) * (last.position - first.position)
            normal = (first.normal + last.normal) / 2.0
            still = swing.start is None or swing.end is None
            path[inside] = line + (0.0 if still else LIFT) * np.sin(np.pi * u) ** 2 * normal
        positions[name] = path
    return positions


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Displayed):
    """Samples of one motion, planned or executed.

    Configurations follow Pinocchio: ``q = [pelvis position, xyzw quaternion, joint angles]``; ``v`` and ``a``
    hold the pelvis' parts in the *pelvis* frame, then the joints' rates. All else is in the world frame.

    Attributes:
        time: (n,) increasing [s].
        q: (n, nq) configurations [m, -, rad].
        v: (n, nv) velocities [m/s, rad/s].
        a: (n, nv) accelerations [m/s^2, rad/s^2].
        tau: (n, nv) generalised forces; the first six (pelvis) are zero [N, N.m].
        com: (n, 3) centre of mass [m].
        angular_momentum: (n, 3) about the centre of mass [kg.m^2/s].
        margin: (n,) wrench margin about the CoM, alpha = 1 m [N.m], or of a point mass force margin [N].
        support: (n, c) True where the contact is active.
        contact_force: (n, c, 6) force [N] of the scene and moment about the contact frame's origin [N.m].
        contact_names: c effector names.
        joint_names: nv - 6 hinge names, in the order of ``q[7:]``.
        margin_unit: ``"N.m"`` or ``"N"``.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray
    com: FloatArray
    angular_momentum: FloatArray
    margin: FloatArray
    support: NDArray[np.bool_]
    contact_force: FloatArray
    contact_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    margin_unit: str = "N.m"

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {
            "duration": f"{self.duration:.2f} s", "samples": str(len(self.time)),
            "hinges": str(len(self.joint_names)), "contacts": " ".join(self.contact_names),
        }  # fmt: skip

    def __post_init__(self) -> None:
        n, c, nv = len(self.time), len(self.contact_names), len(self.joint_names) + 6
        wanted = {
            "time": (n,), "q": (n, nv + 1), "v": (n, nv), "a": (n, nv), "tau": (n, nv), "com": (n, 3),
            "angular_momentum": (n, 3), "margin": (n,), "support": (n, c), "contact_force": (n, c, 6),
        }  # fmt: skip
        if n == 0:
            raise MotionFileError("motion has no samples; valid: at least one")
        for name, shape in wanted.items():
            array = np.array(getattr(self, name), dtype=np.bool_ if name == "support" else np.float64)
            if array.shape != shape:
                raise MotionFileError(f"motion {name} has shape {array.shape}; valid: {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if n > 1 and not np.all(np.diff(self.time) > 0):
            raise MotionFileError("motion time does not increase; valid: strictly increasing seconds")

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    def to_frame(self) -> "DataFrame":
        """Table with one row for each sample, indexed by time; units stand in the names of the columns."""
        from pandas import DataFrame, Index

        root = {f"pelvis_{axis}_m": self.q[:, k] for k, axis in enumerate("xyz")}
        root |= {f"pelvis_q{axis}": self.q[:, 3 + k] for k, axis in enumerate("xyzw")}
        columns = {f"com_{axis}_m": self.com[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"margin_{self.margin_unit}": self.margin} | root
        for k, name in enumerate(self.joint_names):
            columns |= {f"{name}_rad": self.q[:, 7 + k], f"{name}_Nm": self.tau[:, 6 + k]}
        for k, name in enumerate(self.contact_names):
            forces = {f"{name}_force_{axis}_N": self.contact_force[:, k, i] for i, axis in enumerate("xyz")}
            columns |= {f"{name}_touches": self.support[:, k]} | forces
        return DataFrame(columns, index=Index(self.time, name="time_s"))

    def then(self, after: "Motion") -> "Motion":
        """Two motions of one body, of which the second begins where this one ends, as one.

        MotionFileError if they have other joints or another unit of the margin.
        """
        if (self.joint_names, self.margin_unit) != (after.joint_names, after.margin_unit):
            raise MotionFileError("motions that follow each other differ; valid: same joints, same margins")
        names = (*self.contact_names, *(n for n in after.contact_names if n not in self.contact_names))
        first, second = ({
            **one.arrays(), "support": one._of_contacts(names, one.support),
            "contact_force": one._of_contacts(names, one.contact_force),
        } for one in (self, after))  # fmt: skip
        second["time"] = second["time"] + (self.time[-1] - after.time[0])
        joined = {name: np.concatenate([array[:-1], second[name]]) for name, array in first.items()}
        return Motion(
            **joined, contact_names=names, joint_names=self.joint_names, margin_unit=self.margin_unit
        )

    def _of_contacts(self, names: tuple[str, ...], values: NDArray) -> NDArray:
        """(n, c, ...) values of contacts for more of them, 0 of those that the motion has not."""
        found = np.zeros((len(values), len(names), *values.shape[2:]), dtype=values.dtype)
        found[:, [names.index(name) for name in self.contact_names]] = values
        return found

    def arrays(self) -> dict[str, NDArray]:
        """The array fields by name, in their order of declaration."""
        values = ((f.name, getattr(self, f.name)) for f in fields(self))
        return {name: value for name, value in values if isinstance(value, np.ndarray)}


@dataclass(frozen=True, eq=False)
class PhaseTable:
    """When each contact is active.

    Attributes:
        instants: (phases + 1,) key instants [s].
        supports: Effectors in contact in each phase.
    """

    instants: FloatArray
    supports: tuple[tuple[str, ...], ...]

    def __len__(self) -> int:
        return len(self.supports)

    def phase_at(self, time: FloatArray) -> np.ndarray:
        """Index of the phase at each time."""
        return np.clip(np.searchsorted(self.instants, time, side="right") - 1, 0, len(self) - 1)


def phases_of(motion: Motion, schedule: ContactSchedule | None = None) -> PhaseTable:
    """Phases of the schedule, or, without one, of the motion's own support table."""
    if schedule is not None:
        stances = tuple(tuple(phase.stance.effectors) for phase in schedule.sequence)
        return PhaseTable(schedule.instants, stances)
    changes = np.flatnonzero(np.any(motion.support[1:] != motion.support[:-1], axis=1)) + 1
    starts = np.concatenate([[0], changes])
    supports = tuple(tuple(compress(motion.contact_names, motion.support[start])) for start in starts)
    return PhaseTable(frozen_array(np.append(motion.time[starts], motion.time[-1]), "instants"), supports)


def com_velocity(motion: Motion) -> FloatArray:
    """(n, 3) velocity of the centre of mass by central differences [m/s]."""
    if len(motion.time) < 2:
        return np.zeros((len(motion.time), 3))
    return np.gradient(motion.com, motion.time, axis=0)


def effector_positions(
    body: BodyModel, motion: Motion, names: tuple[str, ...], schedule: ContactSchedule | None = None
) -> dict[str, FloatArray]:
    """(n, 3) position of each named effector [m]; the feet of a point mass follow the schedule."""
    if not body.is_point_mass:
        return dict(zip(names, point_paths(body, motion.q, names), strict=True))
    paths = dict.fromkeys(names, motion.com) if schedule is None else foot_positions(schedule, motion.time)
    return {name: paths[name] for name in names}


def point_paths(body: BodyModel, q: FloatArray, names: Sequence[str]) -> FloatArray:
    """(k, n, 3) effectors, or else origins of segments, in postures (n, nq) in the world [m].

    Raises:
        BodyError: If the body has neither of a name.
    """
    model, data, ends = body.pinocchio, body.pinocchio.createData(), body.effectors
    frames = [body.effector_frame(name) if name in ends else body.segment_frame(name) for name in names]
    # Views of Pinocchio's memory: they follow whatever is computed in these data.
    views = [data.oMf[frame].translation for frame in frames]
    places = np.empty((len(q), len(names), 3))
    for number, posture in enumerate(q):
        pin.framesForwardKinematics(model, data, posture)
        places[number] = views
    return np.ascontiguousarray(places.transpose(1, 0, 2))


def segment_positions(body: BodyModel, q: FloatArray) -> dict[str, FloatArray]:
    """(3,) origin of each segment and effector, under ``effector/NAME``, in one configuration [m]."""
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    frames = {segment.name: body.segment_frame(segment.name) for segment in body.segments}
    frames |= {f"effector/{name}": body.effector_frame(name) for name in body.effectors}
    return {name: data.oMf[frame].translation.copy() for name, frame in frames.items()}
