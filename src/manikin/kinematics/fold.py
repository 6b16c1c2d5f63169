"""Postures folded under a ceiling, and the height of the centre of mass there.

Under a ceiling a body can squat with an upright trunk or stoop on straight legs; recorded people go half way
([Qiu2012]_ 3.2.3: CoM at about 0.85, 0.80 and 0.65 m under beams of 1.45, 1.30 and 1.10 m, within 3 cm of the
mean of our two extremes).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.segments import Shape, ShapeKind
from manikin.contact import Contact, sole
from manikin.errors import BodyError
from manikin.kinematics.posture_problem import PostureProblem, com_target, touching_pairs
from manikin.kinematics.posture_search import PostureResult, SolverSettings, generate_posture
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.scene import Box, Obstacle, Proximity, Scene

HEAD_CLEARANCE = 0.03
"""Distance kept from the ceiling [m]."""
HABIT = 0.5
"""Posture of recorded people between the squat (0) and the stoop on straight legs (1)."""
FEET_APART = 0.115
"""Distance of the soles' centres over stature."""

TRUNK = ("pelvis", "lumbar", "thorax", "neck", "head")
"""Segments that must pass below an obstacle together; arms and legs go their own ways."""

STEP = 0.08
"""Step in which the ceiling is lowered [m]."""

_BISECTIONS = 5
_SETTINGS = SolverSettings(tolerance=1e-4, clearance_tolerance=1e-3, restarts=False, explain=False)


@dataclass(frozen=True, eq=False)
class Fold:
    """A body standing folded under a ceiling; everything is relative to its supports.

    Attributes:
        squat: CoM height with the trunk as upright as possible [m].
        stoop: CoM height with the legs as straight as possible: the greatest found [m].
        com_height: CoM height half way between them, where a posture was found as well [m].
        footprint: (4, 2) corners of the rectangle under trunk and head, from the CoM, x forward, y left [m].
        q: (nq,) that posture, facing along x with the feet about the origin.
    """

    squat: float
    stoop: float
    com_height: float
    footprint: FloatArray
    q: FloatArray


@lru_cache(maxsize=64)
def fold_under(body: BodyModel, height: float) -> Fold | None:
    """Fold a standing body under a ceiling at a height above its supports [m]; None without such a posture.

    Results are kept by the body's identity. BodyError if the body has no stature or no soles.
    """
    q, lowest = _squat(body, height)
    if lowest > height:
        return None
    folder = _Folder(body, height)
    low, stoop = folder.com_height(q), folder.stoop(q)
    middle = folder.posture(low + HABIT * (stoop - low), q)
    chosen = middle.q if middle.succeeded else q
    return Fold(low, stoop, folder.com_height(chosen), folder.footprint(chosen), chosen)


def level_feet(body: BodyModel) -> tuple[Contact, Contact]:
    """Soles of a person about the origin of a level floor, toes along x; BodyError without soles."""
    if body.stature is None or body.sole_length is None or body.sole_width is None:
        raise BodyError(f"body {body.name!r} has no stature or soles; valid: a human body")
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    half = 0.5 * FEET_APART * body.stature
    return sole("left_foot", (0.0, half, 0.0), **size), sole("right_foot", (0.0, -half, 0.0), **size)


def lowest_ceiling(body: BodyModel) -> float:
    """Height of the lowest ceiling under which the body was found to fold, to :data:`STEP` [m]."""
    return _squat(body, STEP)[1]


def _squat(body: BodyModel, height: float) -> tuple[FloatArray, float]:
    """Squat under a ceiling at a height, or as low as it goes, and the height of the ceiling there [m].

    The ceiling is lowered onto the standing body step by step, each posture beginning from the one before, so
    that the result does not jump between unlike postures.
    """
    q, lowest = body.standing_posture(), np.inf
    top = float(Configuration(body).effector_placement("head")[1][2]) + 2.0 * HEAD_CLEARANCE
    for ceiling in [*np.arange(top, height, -STEP).tolist(), height]:
        squat = _Folder(body, ceiling).posture(None, q)
        if not squat.succeeded:
            break
        q, lowest = squat.q, ceiling
    return q, lowest


class _Folder:
    """The posture problems of one body under one ceiling."""

    def __init__(self, body: BodyModel, height: float) -> None:
        self._body = body
        ceiling = Obstacle("ceiling", Box((10.0, 10.0, 1.0)), translation=(0.0, 0.0, height + 0.5))
        self._proximity = Proximity(body, Scene([ceiling]))
        self._feet = level_feet(body)
        self._ignored = touching_pairs(body, ((foot.effector, "floor") for foot in self._feet))
        self._configuration = Configuration(body)

    def posture(self, com_height: float | None, start: FloatArray) -> PostureResult:
        """Posture with the CoM over the feet at a height, or at any."""
        problem = PostureProblem(
            self._body, self._feet, com=com_target(0.0, 0.0, com_height), proximity=self._proximity,
            clearance=HEAD_CLEARANCE, ignore=self._ignored,
        )  # fmt: skip
        return generate_posture(problem, start, settings=_SETTINGS)

    def stoop(self, q: FloatArray) -> float:
        """Greatest CoM height found from posture ``q`` on."""
        low = self.com_height(q)
        high = max(low, 1.1 * float(Configuration(self._body).com[2]))
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            tried = self.posture(middle, q)
            low, high, q = (middle, high, tried.q) if tried.succeeded else (low, middle, q)
        return low

    def com_height(self, q: FloatArray) -> float:
        """Height of the CoM above the supports [m]."""
        return float(self._configuration.update(q).com[2])

    def footprint(self, q: FloatArray) -> FloatArray:
        """Corners of the rectangle about the trunk's and head's shapes, relative to the CoM."""
        configuration = self._configuration.update(q)
        corners = []
        for name in TRUNK:
            rotation, position = configuration.segment_placement(name)
            for shape in self._body.segment(name).shapes:
                centre = (position + rotation @ shape.translation)[:2]
                half = _half_extents(shape, rotation @ shape.rotation)[:2]
                corners += [centre - half, centre + half]
        (back, right), (front, left) = np.min(corners, axis=0), np.max(corners, axis=0)
        rectangle = np.array([[front, left], [back, left], [back, right], [front, right]])
        return frozen_array(rectangle - configuration.com[:2], "footprint [m]", (4, 2))


def _half_extents(shape: Shape, rotation: FloatArray) -> FloatArray:
    """(3,) half size of the axis-aligned box around a shape whose axes are turned by ``rotation`` [m]."""
    if shape.kind is ShapeKind.BOX:
        return np.abs(rotation) @ (0.5 * shape.size)
    half_length = 0.5 * shape.size[1] if shape.kind is ShapeKind.CAPSULE else 0.0
    return shape.size[0] + half_length * np.abs(rotation[:, 2])
