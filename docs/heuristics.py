"""Compare what contacts can exert that were chosen by different heuristics: ``python docs/heuristics.py``.

Writes ``docs/heuristics.json``, of which ``docs/generate.py`` makes the table, and the figures in
``docs/images``; with ``--figures`` the figures alone. The scenes are like those of Tonneau (2015), 8.1.3;
their sizes are ours.
"""

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

from manikin.body import BodyModel, Configuration, human, integrate, limb_named
from manikin.body.limbs import parent_segment
from manikin.contact import ContactKind
from manikin.errors import InputError
from manikin.kinematics import LimbKinematics
from manikin.kinematics.efort import Task
from manikin.kinematics.limb_samples import LimbSamples, sample_limbs
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts import (
    ClosestDistance,
    ContactGenerator,
    ContactRules,
    Efort,
    GeneratedContact,
    Heuristic,
    Manipulability,
    Random,
    StrongEfort,
)
from manikin.reports.figures import ChoicePanel, contact_choice_figure, save_figure
from manikin.scene import Box, Obstacle, Scene

DOCS = Path(__file__).parent
RESULTS = DOCS / "heuristics.json"
POSES = 150
"""Trunk poses of each scene."""
SAMPLES = 10_000
SIDES = 8
"""Sides of the pyramid inside the friction cone."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One scene and what is asked in it.

    Attributes:
        scene: The surroundings.
        q: (nq,) the body in the middle of its poses.
        limbs: Names of the limbs that are asked for a contact.
        task: Draws a task.
        spread: (6,) largest moves of the root [m, rad].
        kind: How the effectors touch; their own way when None.
    """

    scene: Scene
    q: FloatArray
    limbs: tuple[str, ...]
    task: Callable[[np.random.Generator], Task]
    spread: FloatArray
    kind: ContactKind | None = None


def box(name: str, size: tuple[float, float, float], place: tuple[float, float, float]) -> Obstacle:
    """Obstacle parallel to the axes."""
    return Obstacle(name, Box(size), translation=place)


def pushing(body: BodyModel) -> Comparison:
    """Both hands on a cupboard that shall be pushed away (Fig. 8.3)."""
    scene = Scene([box("cupboard", (0.6, 1.2, 1.9), (0.8, 0.0, 0.95))])
    push = Task((1.0, 0.0, 0.0), {"left_arm", "right_arm"})
    spread = np.array([0.1, 0.15, 0.05, 0.1, 0.15, 0.2])
    return Comparison(scene, body.standing_posture(), ("left_arm", "right_arm"), lambda _: push, spread)


def rising(body: BodyModel) -> Comparison:
    """Hands on armrests or a table, feet on the floor, to get up from a chair (Fig. 8.6)."""
    bent = {"hip_flexion": 1.45, "knee_flexion": 1.5, "elbow_flexion": 0.7, "shoulder_abduction": 0.35}
    q = body.posture({f"{side}_{name}": bent[name] for side in ("left", "right") for name in bent})
    q[2] = 0.58
    chair = [
        box("seat", (0.4, 0.45, 0.05), (-0.1, 0.0, 0.42)),
        box("back", (0.05, 0.5, 0.5), (-0.33, 0.0, 0.75)),
        box("left rest", (0.4, 0.06, 0.04), (-0.1, 0.32, 0.66)),
        box("right rest", (0.4, 0.06, 0.04), (-0.1, -0.32, 0.66)),
        box("table", (0.7, 1.2, 0.04), (0.75, 0.0, 0.74)),
    ]
    up = Task((0.0, 0.0, 1.0))
    spread = np.array([0.06, 0.03, 0.06, 0.05, 0.2, 0.1])
    return Comparison(Scene(chair), q, ("left_arm", "right_arm"), lambda _: up, spread)


def climbing(body: BodyModel) -> Comparison:
    """Hands and feet on the holds of a wall, the body moving in any direction along it (Fig. 8.7)."""
    rng = np.random.default_rng(1)
    holds = [
        box(f"hold {n}", (0.14, 0.16, 0.06), (0.44, rng.uniform(-1.2, 1.2), rng.uniform(0.3, 2.6)))
        for n in range(40)
    ]
    q = body.standing_posture()
    q[2] += 0.4
    limbs = ("left_arm", "right_arm", "left_leg", "right_leg")
    spread = np.array([0.08, 0.15, 0.2, 0.1, 0.1, 0.1])
    scene = Scene([box("wall", (0.2, 6.0, 6.0), (0.6, 0.0, 3.0)), *holds])
    return Comparison(scene, q, limbs, _along_the_wall, spread, ContactKind.POINT)


def _along_the_wall(rng: np.random.Generator) -> Task:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return Task((0.0, float(np.cos(angle)), float(np.sin(angle))))


SCENES: Mapping[str, Callable[[BodyModel], Comparison]] = {
    "push": pushing, "rise": rising, "climb": climbing,
}  # fmt: skip


def heuristics(body: BodyModel, samples: Mapping[str, LimbSamples]) -> dict[str, Heuristic]:
    """Every heuristic that is compared."""
    return {
        "efort": Efort(), "strength": StrongEfort.of(body, samples), "distance": ClosestDistance(),
        "manipulability": Manipulability(), "random": Random(0),
    }  # fmt: skip


def limb_strength(
    jacobian: FloatArray,
    torque_lower: FloatArray,
    torque_upper: FloatArray,
    direction: FloatArray,
    normal: FloatArray | None,
    friction: float = 0.7,
) -> float:
    """Largest force along a direction that the scene can exert on a limb at rest [N].

    ``max f . v`` over the forces ``f`` on the effector with ``-J^T f`` within the torque limits and,
    where the limb does not hold on, inside the friction cone about the normal. The weight of the limb itself
    is left out. This is what EFORT (5.12) stands for in the request, where all joints count alike
    and friction does not exist.

    Args:
        jacobian: (3, k) of the effector's translation [m/rad].
        torque_lower: (k,) most negative torques of the joints [N.m].
        torque_upper: (k,) largest ones [N.m].
        direction: (3,) unit vector ``v``, in the Jacobian's frame.
        normal: (3,) unit normal of the surface in the same frame, or None for a grasp.
        friction: Coulomb coefficient.

    Returns:
        At least 0; infinite where the limb carries the direction without torque.

    Raises:
        InputError: If the linear program fails for another reason.
    """
    table, bounds = [jacobian.T, -jacobian.T], [-torque_lower, torque_upper]
    if normal is not None:
        across = np.linalg.svd(normal[None])[2][1:]
        turns = 2.0 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
        sides = np.column_stack([np.cos(turns), np.sin(turns)]) @ across
        table.append(sides - friction * np.cos(np.pi / SIDES) * normal)
        bounds.append(np.zeros(SIDES))
    found = linprog(-direction, A_ub=np.vstack(table), b_ub=np.concatenate(bounds), bounds=[(None, None)] * 3)
    if found.status == 3:
        return float("inf")
    if found.status != 0:
        raise InputError(f"exertable force cannot be computed ({found.message}); valid: finite values")
    return float(-found.fun)


def force_of(body: BodyModel, answer: GeneratedContact, task: Task) -> float:
    """Force along the task that the posture of a contact can exert [N]."""
    limb = limb_named(body, answer.limb)
    chain = LimbKinematics(body, limb)
    assert answer.q is not None
    assert answer.contact is not None
    jacobian = chain.place(answer.q[None, chain.slots]).jacobians[0]
    turn, _ = Configuration(body, answer.q).segment_placement(parent_segment(body, limb))
    return limb_strength(
        jacobian, chain.torque_lower, chain.torque_upper, task.reaction_on(answer.limb) @ turn,
        answer.contact.normal @ turn,
        ContactRules().friction,
    )  # fmt: skip


def compare(
    body: BodyModel, samples: Mapping[str, LimbSamples], make: Callable[[BodyModel], Comparison]
) -> dict:
    """Mean forces of all heuristics over the poses and limbs for which each found a contact."""
    job = make(body)
    generator = ContactGenerator(body, job.scene, samples)
    orders = heuristics(body, samples)
    rng = np.random.default_rng(0)
    forces: dict[str, list[float]] = {name: [] for name in orders}
    asked = 0
    for _ in range(POSES):
        move = np.zeros(body.nv)
        move[:6] = rng.uniform(-1.0, 1.0, 6) * job.spread
        q, task = integrate(body, job.q, move), job.task(rng)
        for limb in job.limbs:
            asked += 1
            answers = {n: generator.request(q, limb, task, h, kind=job.kind) for n, h in orders.items()}
            if all(answer.found for answer in answers.values()):
                for name, answer in answers.items():
                    forces[name].append(force_of(body, answer, task))
    ahead = np.array(forces["efort"]) >= np.array(forces["distance"]) - 1e-6
    return {
        "asked": asked, "compared": len(ahead), "ahead_of_distance": float(np.mean(ahead)),
        "mean_force_N": {name: float(np.mean(values)) for name, values in forces.items()},
        "median_force_N": {name: float(np.median(values)) for name, values in forces.items()},
    }  # fmt: skip


def chosen(
    generator: ContactGenerator,
    job: Comparison,
    task: Task,
    heuristic: Heuristic,
    title: str,
    arrow: FloatArray,
) -> ChoicePanel:
    """One limb after the other put where a heuristic wants it."""
    q, contacts, limbs = job.q, [], []
    for limb in job.limbs:
        answer = generator.request(q, limb, task, heuristic, kind=job.kind)
        if answer.q is not None and answer.contact is not None:
            q = answer.q
            contacts.append(answer.contact)
            limbs.append(limb)
    return ChoicePanel(title, q, contacts, limbs, arrow)


def draw(body: BodyModel, samples: Mapping[str, LimbSamples], name: str, title: str, azimuth: float) -> None:
    """Figure of one scene: before, by the closest distance, by EFORT; of climbing for several tasks."""
    job = SCENES[name](body)
    generator = ContactGenerator(body, job.scene, samples)
    tasks = [job.task(np.random.default_rng(0))]
    if name == "climb":
        tasks = [Task((0.0, 0.0, 1.0)), Task((0.0, 1.0, 0.0)), Task((0.0, -1.0, 0.0)), Task((0.0, 0.0, -1.0))]
    arrow = tasks[0].direction
    panels = [
        ChoicePanel("before", job.q, task=arrow),
        chosen(generator, job, tasks[0], ClosestDistance(), "closest distance", arrow),
    ]
    panels += [chosen(generator, job, task, Efort(), "EFORT", task.direction) for task in tasks]
    figure = contact_choice_figure(
        body, job.scene, panels, title, azimuth_deg=azimuth, columns=3, elevation_deg=12.0
    )
    save_figure(figure, DOCS / "images" / f"efort-{name}.png")


if __name__ == "__main__":
    person = human()
    drawn = sample_limbs(person, np.random.default_rng(0), SAMPLES)
    draw(person, drawn, "push", "Pushing a cupboard", -60.0)
    draw(person, drawn, "rise", "Getting up from a chair at a table", -50.0)
    draw(person, drawn, "climb", "Climbing in four directions", 215.0)
    found = (
        {}
        if "--figures" in sys.argv
        else {name: compare(person, drawn, make) for name, make in SCENES.items()}
    )
    if found:
        RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
