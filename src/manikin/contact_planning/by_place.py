"""Scores that hardly change within a small place, asked once for each."""

from collections.abc import Callable

import numpy as np

from manikin.contact import Contact, ContactKind
from manikin.contact_planning.candidates import Candidates, Situation
from manikin.contact_planning.touch import ContactRules, make_contact, onto_normal
from manikin.spatial import FloatArray


def score_by_place(candidates: Candidates, spacing: float, value: Callable[[int], float]) -> FloatArray:
    """(n,) scores; candidates on one surface and in one cell of a grid share that of their first.

    Args:
        candidates: n of them.
        spacing: Of the grid [m].
        value: Score of a candidate by its row.
    """
    keys = np.column_stack([candidates.surfaces, np.round(candidates.points / spacing)])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    values = np.array([value(int(row)) for row in first], dtype=np.float64)
    return values[group.ravel()]


def contact_at(
    situation: Situation, candidates: Candidates, row: int, kind: ContactKind, rules: ContactRules
) -> Contact:
    """The contact that a candidate makes, turned onto its surface the shortest way.

    Args:
        situation: Body and limb.
        candidates: Where the limb may touch.
        row: Of the candidate.
        kind: How it touches.
        rules: Friction and strengths.
    """
    turn = onto_normal(situation.rotation @ candidates.rotations[row], candidates.normals[row])
    return make_contact(situation.state.body, situation.limb, kind, candidates.points[row], turn, rules)
