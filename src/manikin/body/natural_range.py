"""Distance of a limb's posture to a violation of its range of motion ([Tonneau2015]_ 4.3.3).

Hips and shoulders of the human have volumes that were learnt from recordings; every other hinge has its
interval. The file of the volumes holds computed distances and no recorded data. The recordings are everyday
and some less everyday movements (walks, turns, runs, steps, climbing, crouching, crawling, sitting, lifting)
of the following sources; ``docs/ranges_of_motion.py`` makes the file again from them.

* "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding
  from NSF EIA-0196217."
* "Motion capture data: ACCAD / The Ohio State University, Open Motion Project, CC BY 3.0 Unported"

Both sides share a volume: equal angles are mirrored postures. Nobody was asked to move as far as possible,
as in the protocol of the thesis, so the volumes are on the narrow side, most of all for arms overhead and
behind the back.
"""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from manikin.body.human_parts import human_hinges
from manikin.body.joint_volume import JointVolume
from manikin.body.limbs import limb_hinges, limb_slots
from manikin.body.model import BodyModel
from manikin.body.segments import Limb, Segment
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, frozen_array

FILE = Path(__file__).with_name("human_volumes.npz")
"""File of the shipped volumes."""

FORMAT = "manikin-joint-volumes-1"
UNIT = 1e-4
"""Unit of the distances in the file [rad]."""


@cache
def human_volumes() -> Mapping[str, JointVolume]:
    """Volumes of ``"thigh"`` (hip) and ``"upper_arm"`` (shoulder), for our human's hinges."""
    return MappingProxyType(load_volumes(FILE))


def load_volumes(path: str | Path) -> dict[str, JointVolume]:
    """Read volumes by segment, without its side, from a NumPy archive with distances in :data:`UNIT`.

    Raises:
        BodyError: If the file is missing or holds none.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            if str(archive["format"]) != FORMAT:
                raise ValueError(f"format {archive['format']}")
            volumes = {}
            for name in sorted({key.split("/")[0] for key in archive.files if "/" in key}):
                origin, step, table = (archive[f"{name}/{key}"] for key in ("origin", "step", "distances"))
                volumes[name] = JointVolume(origin, float(step), UNIT * table)
            return volumes
    except FileNotFoundError:
        raise BodyError(f"{path}: there is no such file; valid: a file of joint volumes") from None
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())[:100]
        raise BodyError(f"{path}: cannot be read ({reason}); valid: a file of joint volumes") from None


@dataclass(frozen=True, eq=False)
class BallRange:
    """A ball joint's volume within the intervals (3,) of its hinges [rad].

    The radius is that of the largest ball of angles that is inside both [rad].
    """

    volume: JointVolume
    lower: FloatArray
    upper: FloatArray
    radius: float

    def normalised(self, angles: FloatArray) -> FloatArray:
        """(...) distance of (..., 3) angles to the nearer violation per radius, negative outside."""
        box = np.minimum(angles - self.lower, self.upper - angles).min(axis=-1)
        return np.minimum(self.volume.distance(angles), box) / self.radius


class NaturalRange:
    """Normalised distance of a limb's angles to a violation of its range of motion.

    Of a ball joint with a volume, it is the distance in the space of its three angles to the surface of the
    volume or to the end of a hinge's interval, whichever is nearer, divided by the radius of the largest ball
    inside. Of any other hinge it is the distance to the nearer end of its interval, divided by half the
    interval. Of a limb it is the least of its joints: 0 at a violation, negative beyond, and 1 only where
    every joint is as far from its limits as it can be. 0.1 rad in one angle change it by no more than 0.1 rad
    over that radius (over half the interval), times the square root of 3 at worst where the grid is coarse.
    """

    def __init__(self, body: BodyModel, limb: Limb) -> None:
        self.limb = limb
        hinges = limb_hinges(body, limb)
        self.lower = np.array([hinge.lower for hinge in hinges])
        self.upper = np.array([hinge.upper for hinge in hinges])
        places = (limb_slots(body, limb) - 7).tolist()
        self._balls: tuple[tuple[slice, BallRange], ...] = tuple(
            (slice(start := places.index(joint.hinges.start), start + 3), joint.range)
            for joint in learnt_joints(body, [body.segment(name) for name in limb.segments])
        )
        taken = {column for where, _ in self._balls for column in range(where.start, where.stop)}
        self._others = np.array([c for c in range(len(hinges)) if c not in taken], dtype=np.int64)

    @property
    def learnt(self) -> bool:
        """Whether a joint of the limb has a learnt volume."""
        return bool(self._balls)

    def normalised(self, angles: ArrayLike) -> FloatArray:
        """(n,) normalised distance of (n, k) angles, negative outside."""
        q, least = np.asarray(angles, dtype=np.float64), self.volume_distance(angles)
        if not len(self._others):
            return np.minimum(least, 1.0)
        lower, upper, part = self.lower[self._others], self.upper[self._others], q[:, self._others]
        of_hinges = np.min(np.minimum(part - lower, upper - part) / (0.5 * (upper - lower)), axis=1)
        return np.minimum(least, of_hinges)

    def volume_distance(self, angles: ArrayLike) -> FloatArray:
        """(n,) the same of the ball joints with volumes alone; infinite without one."""
        q = np.asarray(angles, dtype=np.float64)
        count = len(self.lower)
        if q.ndim != 2 or q.shape[1] != count:
            raise BodyError(f"limb {self.limb.name!r} angles have shape {q.shape}; valid: (n, {count})")
        least = np.full(len(q), np.inf)
        for columns, ball in self._balls:
            least = np.minimum(least, ball.normalised(q[:, columns]))
        return least

    def random_angles(self, rng: np.random.Generator, count: int) -> FloatArray:
        """(count, k) angles, uniform within the range of motion [rad]."""
        parts: list[FloatArray] = []
        kept = 0
        while kept < count:
            drawn = rng.uniform(self.lower, self.upper, (2 * count, len(self.lower)))
            parts.append(drawn[self.volume_distance(drawn) >= 0.0])
            kept += len(parts[-1])
        return np.concatenate(parts)[:count]


@dataclass(frozen=True, eq=False)
class LearntJoint:
    """A ball joint with a learnt volume: the segment that it moves, and its three places among all hinges."""

    segment: str
    hinges: slice
    range: BallRange


def learnt_joints(body: BodyModel, segments: Sequence[Segment] | None = None) -> tuple[LearntJoint, ...]:
    """Hips and shoulders of a body with the human's hinges, or of some segments; none of other bodies."""
    joints: list[LearntJoint] = []
    for segment in body.segments if segments is None else segments:
        part = _learnt_part(segment)
        if part is not None:
            first = body.joint_index(segment.hinges[0].name)
            ends = tuple((hinge.lower, hinge.upper) for hinge in segment.hinges)
            joints.append(LearntJoint(segment.name, slice(first, first + 3), _learnt_range(part, ends)))
    return tuple(joints)


def ball_range(volume: JointVolume, lower: ArrayLike, upper: ArrayLike) -> BallRange:
    """Volume within intervals of three hinges, (3,) each [rad]; BodyError if nothing of it is within them."""
    low, high = (frozen_array(end, "range of a ball joint", (3,), BodyError) for end in (lower, upper))
    ball = BallRange(volume, low, high, 1.0)
    radius = float(ball.normalised(volume.points).max())
    if not radius > 0.0:
        raise BodyError(
            f"nothing from {low.tolist()} to {high.tolist()} is in the volume; valid: ranges that overlap it"
        )
    return BallRange(volume, low, high, radius)


@cache
def _learnt_range(part: str, ends: tuple[tuple[float, float], ...]) -> BallRange:
    """Range of a learnt part for hinges with these ends; the largest ball takes a while to find."""
    lower, upper = zip(*ends, strict=True)
    return ball_range(human_volumes()[part], lower, upper)


def _learnt_part(segment: Segment) -> str | None:
    """Name of the volume of a segment whose hinges are those of the human."""
    side, _, part = segment.name.partition("_")
    if side not in ("left", "right") or part not in human_volumes():
        return None
    own, human = segment.hinges, human_hinges(part, side, lambda _: (1.0, 1.0))
    same = [hinge.name for hinge in own] == [hinge.name for hinge in human]
    return part if same and np.allclose([h.axis for h in own], [h.axis for h in human]) else None
