"""Load on the lumbosacral joint L5/S1 along a motion: net moment, compression and shear of the disc.

The net force and moment come from the inverse dynamics of all that lies above the lumbar joint, with what the
hands carry and what the scene does to them; nothing below has to be known, so that a recording without force
plates has them too. A single equivalent muscle, the model of [Chaffin1999]_ chapter 6, then balances the
moment in the sagittal plane. With the moment ``M`` that bends the trunk forward, the lever ``e`` of the
muscles, and the force ``F`` that the trunk puts on the sacrum, along the normal and along the front of
the upper endplate of S1,

    compression = F_normal + |M| / e,    shear = F_front.

The endplate is fixed in the pelvis and slopes down to the front by 40 degrees when the pelvis is upright
([Chaffin1999]_). L5/S1 lies behind and above the hip joints where [Dumas2007]_ has it. Our segments above
the lumbar joint weigh 49.1 % of a man and 45.8 % of a woman, what [Dumas2007]_ has above L5/S1 weighs 49.4
and 45.1 %: no slice of the pelvis is added.

Ours: the lever is the same for the muscles of the back and of the belly. Side bending and twisting moments
are given but load no muscle here; pressure in the abdomen is not taken off.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.strength import with_masses
from manikin.contact import ContactSchedule
from manikin.ergonomics.body_parts import parts_of
from manikin.errors import BodyError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number

MODEL = "single equivalent muscle, sagittal (Chaffin, Andersson and Martin 1999)"
"""Name of the model in reports."""

LEVER, LEVER_RANGE = 0.05, (0.03, 0.09)
"""Lever of the muscles about the disc, and accepted ones [m]; published models take 5 to 6 cm."""

ENDPLATE_SLOPE = np.deg2rad(40.0)
"""Slope of the upper endplate of S1 in an upright pelvis, down to the front [rad]."""

ACTION_LIMIT, MAXIMUM_LIMIT = 3400.0, 6400.0
"""Compression above which NIOSH asks for action, and the largest permissible one [N] ([NIOSH1981]_)."""

SHEAR_LIMIT = 1000.0
"""Shear of up to a hundred loadings a day [N] ([Gallagher2012]_)."""

LEVELS = {
    1: "below the action limit",
    2: "above the action limit",
    3: "above the maximum permissible limit",
}
"""Meaning of the levels of compression."""

L5S1_FROM_HIPS = {
    "male": (-0.056 / 1.77, 0.075 / 1.77),
    "female": (-0.054 / 1.61, 0.093 / 1.61),
}
"""Forward and upward from the middle of the hip joints, shares of the stature ([Dumas2007]_)."""


@dataclass(frozen=True, eq=False)
class LowBack:
    """Loads on L5/S1, (n,) each; frames whose dynamics are not known are NaN.

    Attributes:
        time: [s].
        flexion_moment: That bends the trunk forward and that the extensors of the back hold [N.m].
        side_moment, twist_moment: About the pelvis' forward and upward axes, as the trunk loads the pelvis
            [N.m].
        muscle: Force of the equivalent muscle [N].
        compression: Of the disc, positive [N].
        shear: Along the endplate, positive where the trunk would slide forward [N].
        lever: Of the muscle [m].
        model: Name of the muscle model.
    """

    time: FloatArray
    flexion_moment: FloatArray
    side_moment: FloatArray
    twist_moment: FloatArray
    muscle: FloatArray
    compression: FloatArray
    shear: FloatArray
    lever: float = LEVER
    model: str = MODEL

    @property
    def known(self) -> np.ndarray:
        """(n,) whether the loads are known."""
        return np.asarray(np.isfinite(self.compression))

    @property
    def level(self) -> int:
        """Of the largest compression, a key of :data:`LEVELS`."""
        return compression_level(float(np.nanmax(self.compression)))

    def as_dict(self, weight: FloatArray) -> dict[str, Any]:
        """Plain values, of at least one known frame; frames stand for times (n,) [s]."""
        share = np.where(self.known, weight, 0.0)
        share /= share.sum()
        worst = int(np.nanargmax(self.compression))
        shear = int(np.nanargmax(np.abs(self.shear)))
        return {
            "max_compression_N": float(self.compression[worst]), "max_at_s": float(self.time[worst]),
            "level": LEVELS[self.level], "flexion_moment_Nm": float(self.flexion_moment[worst]),
            "side_moment_Nm": float(self.side_moment[worst]),
            "twist_moment_Nm": float(self.twist_moment[worst]), "max_shear_N": float(self.shear[shear]),
            "share_above_3400_N": float(share[self.compression > ACTION_LIMIT].sum()),
            "share_above_6400_N": float(share[self.compression > MAXIMUM_LIMIT].sum()),
            "share_shear_above_1000_N": float(share[np.abs(self.shear) > SHEAR_LIMIT].sum()),
            "lever_m": self.lever, "model": self.model, "known_share": float(self.known.mean()),
        }  # fmt: skip


def compression_level(compression: float) -> int:
    """Level of a compression [N], a key of :data:`LEVELS`."""
    return 1 + int(compression > ACTION_LIMIT) + int(compression > MAXIMUM_LIMIT)


def disc_load(
    moment: FloatArray, normal: FloatArray, front: FloatArray, lever: float = LEVER
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Muscle force, compression and shear (n,) of the disc [N], see the module.

    Args:
        moment: (n,) that bends the trunk forward [N.m].
        normal: (n,) force that the trunk puts on the sacrum, against the endplate [N].
        front: (n,) the same, forward along the endplate [N].
        lever: Of the muscle [m].
    """
    muscle = np.abs(moment) / lever
    return muscle, normal + muscle, front


def low_back_load(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None = None, *, lever: float = LEVER
) -> LowBack:
    """Load on L5/S1 in every frame of a motion of a human.

    Args:
        body: With what it carries all the time.
        motion: Planned, executed or recorded. A frame in which something above the lumbar joint is supported
            with a force that is not known is NaN.
        schedule: Contacts with what is carried in single phases.
        lever: Of the equivalent muscle [m].

    Raises:
        BodyError: If the body is no human.
        InputError: If the lever is not from 3 to 9 cm.
    """
    finite_number(lever, "lever of the back's muscles [m]", at_least=LEVER_RANGE[0], at_most=LEVER_RANGE[1])
    wrench = _wrench_on_pelvis(body, motion, schedule)  # force and moment about L5/S1, pelvis axes
    force, moment = wrench[:, :3], wrench[:, 3:]
    slope = np.array([np.sin(ENDPLATE_SLOPE), 0.0, np.cos(ENDPLATE_SLOPE)])  # normal of the endplate, up
    front = np.array([np.cos(ENDPLATE_SLOPE), 0.0, -np.sin(ENDPLATE_SLOPE)])
    bending = moment[:, 1]
    loads = disc_load(bending, -force @ slope, force @ front, lever)
    return LowBack(motion.time, bending, moment[:, 0], moment[:, 2], *loads, lever=lever)


def l5s1_in_pelvis(body: BodyModel) -> FloatArray:
    """(3,) L5/S1 in the pelvis' frame [m]; BodyError if the body is no human of a known stature."""
    parts_of(body)
    if body.stature is None or body.name != "human":
        raise BodyError(f"body {body.name!r} has no L5/S1; valid: a human")
    forward, up = L5S1_FROM_HIPS[body.sex or "male"]
    return body.stature * np.array([forward, 0.0, up])


def _wrench_on_pelvis(body: BodyModel, motion: Motion, schedule: ContactSchedule | None) -> FloatArray:
    """(n, 6) force and moment about L5/S1 of the trunk on the pelvis, pelvis axes [N, N.m]."""
    place, lumbar = l5s1_in_pelvis(body), parts_of(body).trunk[1]
    above = _effectors_above(body, lumbar)
    columns = [number for number, name in enumerate(motion.contact_names) if name in above]
    found = np.full((len(motion.time), 6), np.nan)
    for carrier, rows in _bodies(body, motion, schedule):
        model = carrier.pinocchio
        data, joint = model.createData(), _first_joint(carrier, lumbar)
        root = carrier.segment_frame(parts_of(body).trunk[0])
        for k in rows:
            pin.rnea(model, data, motion.q[k], motion.v[k], motion.a[k])
            pin.framesForwardKinematics(model, data, motion.q[k])  # the former leaves the places unknown
            # What the pelvis must give the trunk, in world axes about the world's origin.
            given = data.oMi[joint].act(data.f[joint])
            force, moment = given.linear.copy(), given.angular.copy()
            for column in columns:
                if not motion.support[k, column]:
                    continue
                scene = motion.contact_force[k, column]
                frame = data.oMf[carrier.effector_frame(motion.contact_names[column])]
                force -= scene[:3]
                moment -= scene[3:] + np.cross(frame.translation, scene[:3])
            pelvis: Any = data.oMf[root]
            at = pelvis.act(place)
            moment -= np.cross(at, force)
            found[k, :3], found[k, 3:] = -pelvis.rotation.T @ force, -pelvis.rotation.T @ moment
    return found


def _bodies(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None
) -> Iterator[tuple[BodyModel, list[int]]]:
    """The body with what it carries, and the frames in which it does."""
    if schedule is None or all(phase.load is None for phase in schedule.sequence):
        yield body, list(range(len(motion.time)))
        return
    phases = schedule.phase_at(motion.time)
    for number, phase in enumerate(schedule.sequence):
        rows = np.flatnonzero(phases == number).tolist()
        if rows:
            yield (body if phase.load is None else with_masses(body, phase.load.masses)), rows


def _first_joint(body: BodyModel, segment: str) -> int:
    """Pinocchio's index of the hinge next to the parent of a segment."""
    return int(body.pinocchio.getJointId(body.segment(segment).hinges[0].name))


def _effectors_above(body: BodyModel, lumbar: str) -> set[str]:
    """Effectors on the lumbar segment or on what hangs on it."""

    def above(segment: str | None) -> bool:
        return segment is not None and (segment == lumbar or above(body.segment(segment).parent))

    return {name for name, effector in body.effectors.items() if above(effector.segment)}
