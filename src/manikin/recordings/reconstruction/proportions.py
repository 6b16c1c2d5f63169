"""Joint centres of a recorded person: the human with their lengths, and postures without search."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, human
from manikin.body.anthropometry import Anthropometry
from manikin.body.joint_volume import ball_angles, ball_rotation
from manikin.body.segments import SIDES
from manikin.errors import InputError
from manikin.kinematics.point_targets import PointTargets
from manikin.numerics.spatial import FloatArray, frozen_array, unit
from manikin.recordings.readers.marker_sets import joint_of
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.recordings.reconstruction.cleaning import Repair
from manikin.runtime.display import Displayed

CENTRES = tuple(
    f"{side}_{part}" for side in SIDES for part in ("thigh", "leg", "foot", "upper_arm", "forearm", "hand")
)
"""Segments whose origins are hips, knees, ankles, shoulders, elbows and wrists."""


def joint_centres(recording: Recording) -> Mapping[str, FloatArray]:
    """(n, 3) joint centres in the world [m] by segment of :data:`CENTRES`; InputError if one is missing."""
    return {segment: recording.positions[:, joint_of(recording, segment)] for segment in CENTRES}


def far_point(recording: Recording, index: int) -> FloatArray | None:
    """(n, 3) end of the bone that begins at a joint: its first child, or its end [m]; None without one."""
    children, name = np.flatnonzero(recording.parents == index), recording.joint_names[index]
    offset = recording.offsets[children[0]] if children.size else recording.ends.get(name)
    if offset is None or np.linalg.norm(offset) < 1e-3:
        return None
    return recording.positions[:, index] + recording.world_rotations[:, index] @ offset


STRAIGHT = 0.15
"""Sine of the bend below which the carrier's left-right axis counts for a limb's rotation about itself."""

_LIMBS = {
    "thigh": ("pelvis", "leg", "foot", "knee_flexion", 1.0),
    "upper_arm": ("thorax", "forearm", "hand", "elbow_flexion", -1.0),
}
"""Ball joint's segment: what carries it, the joints beyond, the hinge between, and its sense about y."""


def trunk_axes(centres: Mapping[str, FloatArray], part: str) -> FloatArray:
    """(n, 3, 3) axes of the pelvis (``"thigh"``) or thorax (``"upper_arm"``), to the world.

    y from the right joint to the left one, z from between the hips to between the shoulders.
    """
    y = centres[f"left_{part}"] - centres[f"right_{part}"]
    return frames(middle(centres, "upper_arm") - middle(centres, "thigh"), y, keep_y=True)


def analytic_ik(
    body: BodyModel, centres: Mapping[str, FloatArray], pelvis: FloatArray, thorax: FloatArray
) -> FloatArray:
    """(n, nq) postures within the joints' limits, close to the recorded ones.

    Lumbar and thorax share the rotation of the spine, limbs point as recorded, and the bend of knee and elbow
    gives the rotation about the limb; neck, wrists and ankles are at 0. Joint centres are (n, 3) [m]; pelvis
    and thorax (n, 3, 3) are from their axes to the world's.
    """
    q = np.tile(body.zero_posture(), (len(pelvis), 1))
    q[:, :3] = middle(centres, "thigh")
    q[:, 3:7] = Rotation.from_matrix(pelvis).as_quat()
    spine = Rotation.from_matrix(pelvis.transpose(0, 2, 1) @ thorax)
    half = Rotation.from_rotvec(0.5 * spine.as_rotvec()).as_matrix()
    carriers = {"pelvis": pelvis, "thorax": pelvis}
    for name in ("lumbar", "thorax"):
        carriers["thorax"] = carriers["thorax"] @ _set_ball(body, q, name, half)
    for part, (carrier, beyond, end, hinge, sign) in _LIMBS.items():
        for side in SIDES:
            upper = unit(centres[f"{side}_{beyond}"] - centres[f"{side}_{part}"])
            lower = unit(centres[f"{side}_{end}"] - centres[f"{side}_{beyond}"])
            cross = np.cross(upper, lower)
            bent = np.linalg.norm(cross, axis=1)
            y = sign * cross + np.maximum(STRAIGHT - bent, 0.0)[:, None] * carriers[carrier][:, :, 1]
            turns = frames(-upper, y, keep_y=False)
            _set_ball(body, q, f"{side}_{part}", carriers[carrier].transpose(0, 2, 1) @ turns)
            bend = np.arctan2(bent, np.sum(upper * lower, axis=1))
            q[:, 7 + body.joint_index(f"{side}_{hinge}")] = bend
    q[:, 7:] = np.clip(q[:, 7:], body.lower, body.upper)
    return q


def frames(z: FloatArray, y: FloatArray, *, keep_y: bool) -> FloatArray:
    """(n, 3, 3) with columns x, y, z of (n, 3) directions; the one kept is exact."""
    kept, other = (unit(y), z) if keep_y else (unit(z), y)
    other = unit(other - np.sum(other * kept, axis=1, keepdims=True) * kept)
    y, z = (kept, other) if keep_y else (other, kept)
    return np.stack([np.cross(y, z), y, z], axis=-1)


def _set_ball(body: BodyModel, q: FloatArray, segment: str, turns: FloatArray) -> FloatArray:
    """Write the angles of a ball joint, kept to its limits; the (n, 3, 3) turns that they make."""
    hinges = body.segment(segment).hinges
    axes = np.array([hinge.axis for hinge in hinges])
    lower, upper = (np.array([getattr(hinge, end) for hinge in hinges]) for end in ("lower", "upper"))
    angles = np.clip(ball_angles(axes, turns, 0.5 * (lower + upper)), lower, upper)
    first = 7 + body.joint_index(hinges[0].name)
    q[:, first : first + 3] = angles
    return ball_rotation(axes, angles)


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(Displayed):
    """Postures of a body that follow recorded points.

    Attributes:
        body: The body used, with the person's lengths.
        time: (n,) instants, 0 at the first [s].
        q: (n, nq) postures, every hinge within its limits.
        targets: The j points followed: joint centres of a skeleton, named after the segments that begin
            there, or markers.
        residual: (n, j) distance of each from where it was recorded [m]; NaN where it was not seen.
        first_frame: Frame of the recording that is the first instant.
        others: Markers that are not followed, for their names say nothing or they are never seen with others.
        neutral: Segments about which the recording says nothing; their joints are as in standing.
        repairs: Frames in which a marker or joint was not where it belongs.
    """

    body: BodyModel
    time: FloatArray
    q: FloatArray
    targets: PointTargets
    residual: FloatArray
    first_frame: int = 0
    others: tuple[str, ...] = ()
    neutral: tuple[str, ...] = ()
    repairs: tuple[Repair, ...] = ()

    def __post_init__(self) -> None:
        n, what = len(self.time), "reconstruction"
        for name, shape in (("time", (n,)), ("q", (n, self.body.nq))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"{what} {name}", shape))
        if len(self.targets) != n:
            raise InputError(f"{what} of {n} instants with {len(self.targets)} of targets; valid: as many")
        residual, shape = np.array(self.residual, dtype=np.float64), (n, len(self.joints))
        if residual.shape != shape:
            raise InputError(f"{what} residual has shape {residual.shape}; valid: {shape}")
        residual.setflags(write=False)
        object.__setattr__(self, "residual", residual)

    @property
    def rate(self) -> float:
        """Instants per second [Hz]; 1 of a single instant."""
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0]) if len(self.time) > 1 else 1.0

    @property
    def joints(self) -> tuple[str, ...]:
        """(j,) names of the points followed."""
        return self.targets.names

    @cached_property
    def median(self) -> float:
        """Median of all residuals [m]."""
        return float(np.nanmedian(self.residual))

    @cached_property
    def worst(self) -> float:
        """The largest residual [m]."""
        return float(np.nanmax(self.residual))


REFERENCE_STATURE, REFERENCE_MASS = 1.75, 79.0
"""Person of whom others are multiples [m], [kg]."""

_BONES = {
    "thigh": ("thigh", "leg"), "shank": ("leg", "foot"),
    "upper_arm": ("upper_arm", "forearm"), "forearm": ("forearm", "hand"),
}  # fmt: skip

UPRIGHT_SHARE = 90.0
"""Percentile of the distance of shoulders from hips that is the trunk's: a bent trunk is shorter."""


def segment_lengths(centres: Mapping[str, FloatArray]) -> dict[str, float]:
    """Lengths of a person [m] by the names of :data:`manikin.body.anthropometry.MEASURED_LENGTHS`.

    Medians over the instants and the mean of both sides; the trunk's is taken where it is
    extended and no arm is raised. Lengths of which a joint is missing are left out. Joint centres (n, 3) [m],
    see :func:`joint_centres`, are NaN where one is not known.
    """
    pairs = {name: [(f"{side}_{a}", f"{side}_{b}") for side in SIDES] for name, (a, b) in _BONES.items()}
    pairs |= {"hips": [("left_thigh", "right_thigh")], "shoulders": [("left_upper_arm", "right_upper_arm")]}
    found: dict[str, float] = {}
    for name, both in pairs.items():
        apart = [np.linalg.norm(centres[a] - centres[b], axis=1) for a, b in both if {a, b} <= set(centres)]
        known = [np.median(each[~np.isnan(each)]) for each in apart if not np.all(np.isnan(each))]
        if known:
            found[name] = float(np.mean(known))
    if "hips" in found and "shoulders" in found:
        length = np.linalg.norm(middle(centres, "upper_arm") - middle(centres, "thigh"), axis=1)
        if not np.all(np.isnan(length)):
            upright = np.percentile(length[hanging_arms(centres)], UPRIGHT_SHARE)
            # Where arms hang in a crouch only, the trunk is never upright then.
            found["trunk"] = float(max(upright, np.median(length[~np.isnan(length)])))
    return found


def hanging_arms(centres: Mapping[str, FloatArray]) -> NDArray[np.int64]:
    """Instants at which no upper arm is raised, which would raise the shoulders too; all if there are none.

    An arm hangs within 60 degrees of the line from the shoulders to the hips. Instants at which shoulders or
    hips are not known are none; an arm whose elbow is not known counts as hanging.
    """
    down = middle(centres, "thigh") - middle(centres, "upper_arm")
    known, cosines = ~np.isnan(down[:, 0]), []
    for side in SIDES:
        arm = centres.get(f"{side}_forearm", np.full_like(down, np.nan)) - centres[f"{side}_upper_arm"]
        sizes = np.linalg.norm(arm, axis=1) * np.linalg.norm(down, axis=1)
        cosine = np.sum(arm * down, axis=1) / np.maximum(sizes, 1e-9)
        cosines.append(np.where(np.isnan(cosine), 1.0, cosine))
    hanging = (np.min(cosines, axis=0) > 0.5) & known
    return np.flatnonzero(hanging if hanging.any() else known)


def middle(centres: Mapping[str, FloatArray], part: str) -> FloatArray:
    """(n, 3) midway between the left and the right joint [m]."""
    return 0.5 * (centres[f"left_{part}"] + centres[f"right_{part}"])


def human_of(
    centres: Mapping[str, FloatArray], sex: str = "male", mass: float | None = None,
    stature: float | None = None,
) -> BodyModel:  # fmt: skip
    """Our human with the lengths of a recorded person, its masses off the lines between joints.

    A length or stature that is not an adult's raises a BodyError.

    Args:
        centres: (n, 3) joint centres [m]; what is missing is scaled with the stature.
        sex: Table of the segment masses.
        mass: Body mass [kg]; None for the body mass index of 79 kg at 1.75 m.
        stature: Sole to vertex [m]; None for the one whose thigh, shank and trunk add up to theirs.
    """
    lengths = segment_lengths(centres)
    if stature is None:
        usual = Anthropometry(REFERENCE_STATURE, REFERENCE_MASS, sex)
        heights = {name: usual.length(name) for name in ("thigh", "shank")} | {"trunk": usual.shoulder_height}
        known = [name for name in heights if name in lengths]
        share = sum(lengths[n] for n in known) / sum(heights[n] for n in known) if known else 1.0
        stature = REFERENCE_STATURE * share
    if mass is None:
        mass = REFERENCE_MASS * (stature / REFERENCE_STATURE) ** 2
    return human(stature, mass, sex, lengths=lengths, off_axis_masses=True)


def level_heading(q: FloatArray) -> float:
    """Mean heading of (n, nq) postures, from the world's x [rad].

    It is that of the pelvis' x axis, or of its z axis, from the hips to the head, for a person who lies.
    """
    turn = Rotation.from_quat(q[:, 3:7])
    ahead, above = (turn.apply(axis).mean(axis=0)[:2] for axis in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    way = ahead if np.hypot(*ahead) >= np.hypot(*above) else above
    return float(np.arctan2(way[1], way[0]))
