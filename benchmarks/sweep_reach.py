"""Regions of the centre of mass against full inverse kinematics: `python benchmarks/sweep_reach.py 0 20`.

For random bodies on random stances, postures are looked for at random places of the centre of mass in and
around the region. Precision is the share of places inside it for which a posture was found, recall the share
of places with a posture that are inside it. The arguments are the first seed and their number.
"""

import sys

import numpy as np

from manikin.body import human
from manikin.contact import sole
from manikin.kinematics import PostureProblem, SolverSettings, generate_posture
from manikin.kinematics.com_reach import ComReach
from manikin.scene import Proximity, Scene

PLACES = 16
AROUND = 0.12
AXES, BACK = (21, 15, 13), (4, 10, 12)
"""Faces of a region whose normals are the axes of its frame, and those opposite."""


def random_body(rng):
    """Both sexes, 1.50 to 1.95 m, body mass index 19 to 32."""
    stature = rng.uniform(1.50, 1.95)
    return human(stature, rng.uniform(19, 32) * stature**2, str(rng.choice(["male", "female"])))


def random_stance(rng, body):
    """One foot or two, in every third case one above the other."""
    scale = body.stature / 1.75
    size = {"length": body.sole_length, "width": body.sole_width, "friction": 0.7}
    left = sole("left_foot", (0.0, 0.0, 0.0), rng.uniform(-0.4, 0.4), **size)
    if rng.random() < 0.3:
        return [left]
    height = rng.uniform(-0.4, 0.4) if rng.random() < 0.4 else 0.0
    x, y = rng.uniform(-0.8, 0.8) * scale, rng.uniform(-0.6, -0.12) * scale
    return [left, sole("right_foot", (x, y, height * scale), rng.uniform(-0.8, 0.5), **size)]


def found(body, contacts, com, proximity):
    """Whether a posture holds the contacts with the centre of mass at a place."""
    problem = PostureProblem(
        body,
        tuple(contacts),
        com=com,
        proximity=proximity,
        clearance=0.0,
        self_clearance=0.005,
        range_margin=0.04,
    )
    return generate_posture(problem, settings=SolverSettings(tolerance=1e-3, explain=False)).succeeded


def main(first, count):
    """Print one line for each seed and the shares of all."""
    totals = np.zeros(5, dtype=int)  # inside, inside and found, found around, found and inside, empty
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        body = random_body(rng)
        stance = random_stance(rng, body)
        region = ComReach.of(body).region(stance)
        proximity = Proximity(body, Scene([], floor_height=None))
        if region.empty:
            reached = generate_posture(
                PostureProblem(body, tuple(stance), proximity=proximity, clearance=0.0),
                settings=SolverSettings(tolerance=1e-3, explain=False),
            ).succeeded
            totals[4] += reached
            print(seed, "empty", "but reached" if reached else "", flush=True)
            continue
        axes = region.normals[list(AXES)]
        low, high = -region.offsets[list(BACK)] - AROUND, region.offsets[list(AXES)] + AROUND
        points = rng.uniform(low, high, (PLACES, 3)) @ axes
        inside = region.violation(points) <= 0.0
        ok = np.array([found(body, stance, p, proximity) for p in points])
        totals[:4] += [inside.sum(), (inside & ok).sum(), ok.sum(), (inside & ok).sum()]
        missed = [np.round(points[i], 2).tolist() for i in np.flatnonzero(inside & ~ok)]
        print(
            seed,
            body.sex[0],
            f"{body.stature:.2f} {len(stance)} feet",
            f"inside {inside.sum()}",
            f"of them found {(inside & ok).sum()}, found {ok.sum()}",
            missed,
            flush=True,
        )
    print(
        f"precision {totals[1] / totals[0]:.3f} of {totals[0]}, "
        f"recall {totals[3] / totals[2]:.3f} of {totals[2]}, empty but reached {totals[4]}"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
