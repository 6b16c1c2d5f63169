"""Which facets of the polytopes the optimisation has to know about.

Far from all facets ever limit a motion: near an upright stance those of friction and of the
normal-force cap are hundreds of newtons away. The programme is given the nearest ones only,
and every solution is measured against all of them; facets found violated are added and the
programme is solved again (constraint generation).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from manikin.balance import WrenchPolytope
from manikin.centroidal.certificate import facet_margins, phase_times
from manikin.centroidal.problem import CentroidalProblem
from manikin.centroidal.trajectory import CentroidalTrajectory
from manikin.spatial import FloatArray

FIRST_COUNT = 12
"""Facets per phase in the first round."""

FacetIndices = tuple[NDArray[np.int64], ...]
"""Indices of the chosen facets of each phase."""


def facet_distances(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> list[FloatArray]:
    """Least distance of the pseudo-wrench from every facet of each phase [N.m] or [N]."""
    return [
        np.min([block.min(axis=0) for block in facet_margins(problem, trajectory, polytope, times)], axis=0)
        for polytope, times in zip(polytopes, phase_times(trajectory), strict=True)
    ]


def nearest_facets(distances: Sequence[FloatArray], count: int = FIRST_COUNT) -> FacetIndices:
    """Indices of the ``count`` facets with the smallest distances in each phase, in facet order."""
    return tuple(np.sort(np.argsort(values, kind="stable")[:count]) for values in distances)


def with_violated(
    chosen: FacetIndices, distances: Sequence[FloatArray], margin: float, step: int = FIRST_COUNT // 2
) -> FacetIndices:
    """Add to each phase its nearest left-out facets, up to ``step``, that are nearer than ``margin``.

    Args:
        chosen: Facets of the last programme.
        distances: Of its solution, from :func:`facet_distances`.
        margin: Distance that all facets should keep [N.m] or [N].
        step: Number of facets that a phase with a violation receives.
    """
    grown = []
    for indices, values in zip(chosen, distances, strict=True):
        left_out = np.setdiff1d(np.arange(len(values)), indices)
        order = left_out[np.argsort(values[left_out], kind="stable")]
        added = order[:step] if len(order) and values[order[0]] < margin else order[:0]
        grown.append(np.sort(np.concatenate([indices, added])))
    return tuple(grown)
