"""Samples of limbs and requests for contacts: `pytest benchmarks/bench_contact_planning.py`.

Four scenes like those of Tonneau (2015), Table 8.1. A round asks for every limb at 20 places of the root.
Then questions as of ``manikin contact`` about random bodies, scenes, limbs and directions.
"""

import time

import numpy as np
import pytest

from manikin.body import human, insect, integrate, with_knees_and_elbows
from manikin.contact import ContactKind
from manikin.kinematics.efort import Task, usable_efort
from manikin.kinematics.limb_samples import sample_limb, sample_limbs
from manikin.numerics.spatial import rotation_from_rpy
from manikin.planning.contacts import ContactGenerator, Efort
from manikin.planning.contacts.generator import UsableEfort
from manikin.planning.contacts.single_contact import Role, ask_limb
from manikin.scene import Box, Obstacle, Scene

PLACES = 20


def box(name, size, place):
    return Obstacle(name, Box(size), translation=place)


def pushing():
    body = human()
    task = Task((1.0, 0.0, 0.0), {"left_arm", "right_arm"})
    return body, Scene([box("cupboard", (0.6, 1.2, 1.9), (0.9, 0.0, 0.95))]), body.standing_posture(), task


def rising():
    body = human()
    bent = {"hip_flexion": 1.4, "knee_flexion": 1.5, "elbow_flexion": 0.5}
    q = body.posture({f"{side}_{name}": bent[name] for side in ("left", "right") for name in bent})
    q[2] = 0.58
    chair = [
        box("seat", (0.45, 0.5, 0.05), (-0.05, 0.0, 0.42)),
        box("back", (0.05, 0.5, 0.5), (-0.3, 0.0, 0.7)),
        box("left_rest", (0.4, 0.06, 0.04), (0.0, 0.32, 0.66)),
        box("right_rest", (0.4, 0.06, 0.04), (0.0, -0.32, 0.66)),
        box("table", (0.7, 1.2, 0.04), (0.65, 0.0, 0.74)),
    ]
    return body, Scene(chair), q, Task((0.0, 0.0, 1.0))


def climbing():
    body, rng = human(), np.random.default_rng(1)
    holds = [
        box(f"hold{n}", (0.14, 0.16, 0.06), (0.44, rng.uniform(-1.2, 1.2), rng.uniform(0.3, 2.6)))
        for n in range(16)
    ]
    q = body.standing_posture()
    q[2] += 0.4
    return body, Scene([box("wall", (0.2, 6.0, 6.0), (0.6, 0.0, 3.0)), *holds]), q, Task((0.0, 0.0, 1.0))


def crawling():
    body, rng = insect(), np.random.default_rng(2)
    books = [
        box(f"book{n}", (0.06, 0.25, 0.04 + 0.1 * rng.random()), (-0.6 + 0.062 * n, 0.15 * (n % 3 - 1), 0.05))
        for n in range(20)
    ]
    q = body.standing_posture()
    q[2] += 0.08
    return body, Scene(books), q, Task((1.0, 0.0, 0.0))


@pytest.mark.parametrize("count", [10_000, 100_000])
def test_samples_of_a_limb(benchmark, count):
    body = human()
    benchmark(lambda: sample_limb(body, body.limbs[0], np.random.default_rng(0), count))


@pytest.mark.parametrize("count", [1_000, 10_000, 100_000])
@pytest.mark.parametrize("make", [climbing, rising, crawling, pushing])
def test_requests(benchmark, make, count):
    """CPU time of single requests, their average and worst, is in ``extra_info`` [ms]."""
    body, scene, q, task = make()
    generator = ContactGenerator(body, scene, sample_limbs(body, np.random.default_rng(0), count))
    rng = np.random.default_rng(3)
    moves = np.zeros((PLACES, body.nv))
    moves[:, :2], moves[:, 5] = rng.uniform(-0.12, 0.12, (PLACES, 2)), rng.uniform(-0.2, 0.2, PLACES)
    places = [integrate(body, q, move) for move in moves]
    kind = ContactKind.POINT if make is climbing else None
    took, found, candidates = [], [], []

    def requests():
        for place in places:
            for limb in body.limbs:
                start = time.process_time()
                answer = generator.request(place, limb.name, task, kind=kind)
                took.append(time.process_time() - start)
                found.append(answer.found)
                candidates.append(answer.candidates)

    benchmark.pedantic(requests, rounds=3, warmup_rounds=1)
    benchmark.extra_info["average_ms"] = 1e3 * float(np.mean(took))
    benchmark.extra_info["worst_ms"] = 1e3 * float(np.max(took))
    benchmark.extra_info["found"] = float(np.mean(found))
    benchmark.extra_info["candidates"] = float(np.mean(candidates))


def random_body(rng):
    """A person in six of eight draws, or an insect."""
    kind = rng.integers(8)
    if kind < 6:
        stature = rng.uniform(1.5, 1.95)
        mass = rng.uniform(19.0, 32.0) * stature**2
        return with_knees_and_elbows(human(stature, mass, "male" if kind < 3 else "female"))
    return insect(*((0.4, 2.0) if kind == 6 else (0.25, 0.6)))


def random_scene(q, rng):
    """Up to twelve boxes of any heading around the body, every fourth of them leaning, on the floor."""
    size = float(q[2])
    boxes = []
    for number in range(rng.integers(1, 13)):
        lean = rng.uniform(-0.5, 0.5, 2) if number % 4 == 3 else np.zeros(2)
        turn = rotation_from_rpy(*lean, rng.uniform(-np.pi, np.pi))
        away, angle = size * rng.uniform(0.3, 0.9), rng.uniform(-np.pi, np.pi)
        place = [q[0] + away * np.cos(angle), q[1] + away * np.sin(angle), size * rng.uniform(0.0, 1.8)]
        boxes.append(Obstacle(f"box{number}", Box(size * rng.uniform(0.05, 0.7, 3)), turn, place))
    return Scene(boxes)


@pytest.mark.parametrize("seed", [0, 1])
def test_random_questions(benchmark, seed):
    """CPU time of single requests, each of a body somewhere else, is in ``extra_info`` [ms].

    The first time it is asked counts, and beside it the least of three, which other work disturbs less. As
    in a dialogue about one body and scene: 20 places, limbs and tasks for each, 10,000 samples of a limb.
    """
    rng = np.random.default_rng(seed)
    took, least, ends, efforts = [], [], [], []

    def ask():
        for _ in range(12):
            body = random_body(rng)
            q = body.standing_posture()
            limbs = [body.limbs[k] for k in rng.permutation(len(body.limbs))[:4]]
            samples = {limb.name: sample_limb(body, limb, rng) for limb in limbs}
            generator = ContactGenerator(body, random_scene(q, rng), samples)
            for _ in range(20):
                move = np.zeros(body.nv)
                move[:2], move[5] = rng.uniform(-0.3, 0.3, 2) * q[2], rng.uniform(-np.pi, np.pi)
                place, limb = integrate(body, q, move), limbs[rng.integers(len(limbs))]
                role = (Role.AUTO, Role.AUTO, Role.BODY, Role.OBJECT)[rng.integers(4)]
                usable = UsableEfort(usable_efort(body, limb))
                asked = generator, place, limb, rng.normal(size=3), role, Efort(), None, usable
                times = []
                for _ in range(3):
                    start = time.process_time()
                    _, result, value = ask_limb(*asked)
                    times.append(1e3 * (time.process_time() - start))
                took.append(times[0])
                least.append(min(times))
                ends.append(str(result.failure or "found"))
                efforts.append(np.inf if value is None else value / usable.least)

    benchmark.pedantic(ask, rounds=1)
    benchmark.extra_info["average_ms"] = float(np.mean(took))
    benchmark.extra_info["average_of_least_of_three_ms"] = float(np.mean(least))
    benchmark.extra_info["median_ms"] = float(np.median(took))
    benchmark.extra_info["95_percent_ms"] = float(np.percentile(took, 95))
    benchmark.extra_info["worst_ms"] = float(np.max(took))
    benchmark.extra_info["ends"] = {name: ends.count(name) for name in sorted(set(ends))}
    assert min(efforts) >= 1.0
