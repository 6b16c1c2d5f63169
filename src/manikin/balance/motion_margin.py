"""Margin along a motion: how far every sample is from losing balance, in what its stance can give.

Wrenches of planned, executed and recorded motions, of a point mass or of a whole body, are measured in the
stances of their phases. The results do not depend on the world's origin and axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.margin import stability_margins
from manikin.balance.wrench import WrenchPolytope, wrench_polytopes
from manikin.balance.zmp import support_plane
from manikin.contact import Stance
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, wrench_about


@dataclass(frozen=True, eq=False)
class MotionMargin:
    """Distances of every sample from the loss of balance; negative where it is lost already.

    Attributes:
        margin: (n,) residual ball of W_p with moments about the CoM, alpha = 1 m
            ([Qiu2012]_ 4.2.9 case 3, remark 2) [N.m].
        force: (n,) smallest force at the CoM that ends balance ([Qiu2012]_ 4.2.9 case 1) [N]; infinite
            where no force alone does.
        zmp_distance: (n,) of the ZMP to the edge of the support polygon [m]; not a number where contacts do
            not span one plane, or grasp, or press with less than :data:`~manikin.balance.zmp.LEAST_LOAD`.
    """

    margin: FloatArray
    force: FloatArray
    zmp_distance: FloatArray

    @property
    def lowest(self) -> int:
        """Sample of the lowest margin."""
        return int(np.argmin(self.margin))

    @property
    def min_force(self) -> float | None:
        """Smallest force at the CoM that ends balance at any sample [N]; None where no force alone does."""
        least = float(self.force.min(initial=np.inf))
        return least if np.isfinite(least) else None

    @property
    def min_zmp_distance(self) -> float | None:
        """Least distance of the ZMP to the edge [m]; None where it is not known at any sample."""
        known = self.zmp_distance[np.isfinite(self.zmp_distance)]
        return float(known.min()) if len(known) else None

    def __repr__(self) -> str:
        zmp = self.min_zmp_distance
        margin, force = self.margin.min(initial=np.inf), self.force.min(initial=np.inf)
        return (
            f"MotionMargin({len(self.margin)} samples, least margin {margin:.2f} N.m, "
            f"least force {force:.1f} N"
            f"{'' if zmp is None else f', least ZMP distance {zmp:.3f} m'})"
        )


def motion_margin(
    stances: Sequence[Stance], phases: ArrayLike, wrench: ArrayLike, com: ArrayLike, *,
    polytopes: Sequence[WrenchPolytope | None] | None = None,
) -> MotionMargin:  # fmt: skip
    """Margins of a series of pseudo-wrenches, each in the polytope of its phase.

    Without any contact the only admissible wrench is 0: margin and force are then the negative lengths of
    the wrench about the CoM and of its force. A ballistic flight needs none.

    Args:
        stances: Of each phase.
        phases: (n,) index of the phase of each sample.
        wrench: (n, 6) force and moment about the world origin that the contacts have to give [N, N.m].
        com: (n, 3) [m].
        polytopes: W_p of each phase, about any point, where it is known already; else each stance's is
            computed once, and only for phases with samples (ContactError without any cap on a contact).
    """
    w, x, row_phases = _series(wrench, com, phases, len(stances))
    margin, force, zmp = (np.full(len(w), np.nan) for _ in range(3))
    present = np.unique(row_phases).tolist()
    held = [number for number in present if len(stances[number])]
    known = {k: item for k in held if polytopes is not None and (item := polytopes[k]) is not None}
    missing = [number for number in held if number not in known]
    known |= dict(zip(missing, wrench_polytopes([stances[k] for k in missing]), strict=True))
    for number in present:
        rows = np.flatnonzero(row_phases == number)
        if not len(stances[number]):
            about_com = wrench_about(w[rows], x[rows])
            margin[rows] = -np.linalg.norm(about_com, axis=1)
            force[rows] = -np.linalg.norm(about_com[:, :3], axis=1)
            continue
        polytope = known[number]
        margins = stability_margins(polytope, wrench_about(w[rows], polytope.reference), x[rows])
        margin[rows], force[rows] = margins.wrench_about_com, margins.force
        zmp[rows] = _zmp_distances(stances[number], w[rows])
    for values in (margin, force, zmp):
        values.setflags(write=False)
    return MotionMargin(margin, force, zmp)


def _zmp_distances(stance: Stance, wrench: FloatArray) -> FloatArray:
    plane = support_plane(stance)
    if plane is None or len(plane.polygon) < 3:
        return np.full(len(wrench), np.nan)
    return np.where(plane.carries(wrench), plane.zmp_distance(wrench), np.nan)


def _series(
    wrench: ArrayLike, com: ArrayLike, phases: ArrayLike, count: int
) -> tuple[FloatArray, FloatArray, np.ndarray]:
    w, x = np.asarray(wrench, dtype=np.float64), np.asarray(com, dtype=np.float64)
    index = np.asarray(phases, dtype=np.int64)
    if w.ndim != 2 or w.shape[1] != 6 or x.shape != (len(w), 3) or index.shape != (len(w),):
        raise InputError(
            f"wrench has shape {w.shape}, com {x.shape} and phases {index.shape}; valid: (n, 6), (n, 3), (n,)"
        )
    if len(index) and not (index.min() >= 0 and index.max() < count):
        raise InputError(f"phases go from {index.min()} to {index.max()}; valid: 0 to {count - 1}")
    return w, x, index
