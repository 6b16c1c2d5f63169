"""Requests for a contact: what is found is true, best first, and failures say why."""

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human, insect, integrate, limb_named
from manikin.body.limbs import limb_placement, limb_slots
from manikin.body.natural_range import NaturalRange
from manikin.contact import ContactKind
from manikin.errors import BodyError, ContactError
from manikin.kinematics import Aligner, LimbKinematics
from manikin.kinematics.alignment import DAMPING, LARGEST_STEP, LEVER, AlignmentStep
from manikin.kinematics.efort import Task, efort, usable_efort
from manikin.kinematics.limb_collisions import TOUCH, DeepSamples, LimbCollisions, yielding
from manikin.kinematics.limb_samples import sample_limb, sample_limbs
from manikin.numerics.spatial import PlanarTransform, rotation_from_rpy
from manikin.planning.contacts import (
    HEURISTICS,
    ClosestDistance,
    ContactGenerator,
    ContactRules,
    Efort,
    GeneratorSettings,
    Hindrance,
    Random,
    Situation,
    find_candidates,
)
from manikin.planning.contacts.contact_plan import footprint
from manikin.planning.contacts.generator import NATURAL_SLACK, UsableEfort, _order
from manikin.planning.contacts.single_contact import ContactQuestion, find_contact
from manikin.scenarios import load_scenario
from manikin.scenarios.world import contact_rules, start_posture
from manikin.scene import Box, Capsule, Cylinder, Mesh, Obstacle, Proximity, Scene, Sphere, Surface
from manikin.scene.collision import pair_meter
from manikin.scene.surface_table import SurfaceTable

UP = Task((0.0, 0.0, 1.0))
PUSH = Task((1.0, 0.0, 0.0), {"left_arm", "right_arm"})


def wall_scene(distance=0.5):
    return Scene([Obstacle("wall", Box((0.2, 3.0, 3.0)), translation=(distance + 0.1, 0.0, 1.5))])


@pytest.fixture(scope="module")
def at_wall(person, person_samples):
    return ContactGenerator(person, wall_scene(), person_samples)


def test_a_hand_closes_round_a_rail_and_not_round_a_pipe(person, person_samples):
    """The palm lies on the rail's surface, its normal through the axis; what is 10 cm thick is no hold."""
    turn, at = rotation_from_rpy(0.0, np.pi / 2, 0.0), np.array([0.2, -0.35, 0.95])
    samples = {"right_arm": person_samples["right_arm"]}
    for radius in (0.02, 0.05):
        scene = Scene([Obstacle("rail", Cylinder(radius, 2.0), turn, at)])
        generator = ContactGenerator(person, scene, samples)
        q = person.standing_posture()
        answer = generator.request(q, "right_arm", Task((0.0, 0.0, 1.0)), kind=ContactKind.GRASP)
        assert answer.found == (radius == 0.02)
        if answer.found:
            contact = answer.contact
            assert answer.obstacles == scene.touched_obstacles(contact) == ("rail",)
            out = (contact.position - at) * [0.0, 1.0, 1.0]
            np.testing.assert_allclose(out, radius * contact.normal, atol=1e-9)
        assert not generator.request(q, "right_arm", Task((0.0, 0.0, 1.0)), kind=ContactKind.POINT).found


def check(body, scene, answer, q, limb):
    """A contact is exact, on its surface, free of collision and within the joint ranges."""
    state = Configuration(body, answer.q)
    turn, place = state.effector_placement(limb.effector)
    contact = answer.contact
    assert np.abs(place - contact.position).max() < 2e-5
    tilt = np.arccos(min(turn[:, 2] @ contact.normal, 1.0))
    assert tilt < (2e-4 if contact.kind is ContactKind.SOLE else np.deg2rad(15.0) + 1e-6)
    if contact.kind is not ContactKind.GRASP:
        assert scene.supporting_surface(contact).obstacles == answer.obstacles
    slots = limb_slots(body, limb)
    others = np.setdiff1d(np.arange(body.nq), slots)
    assert np.array_equal(answer.q[others], np.asarray(q)[others])
    angles = answer.q[slots]
    assert ((angles >= body.lower[slots - 7]) & (angles <= body.upper[slots - 7])).all()
    moving = {*limb.segments, *(s.name for s in body.segments if s.parent in limb.segments)}
    near = Proximity(body, scene).evaluate(answer.q, 0.0)
    soft, depth = yielding(body, limb)
    for (first, second), distance in zip(near.pairs, near.distance, strict=True):
        inner = "/" in second
        pair = {first.split("/")[0], second.split("/")[0]}
        if moving & pair:
            gives = first.split("/")[0] in soft and second == answer.obstacle
            allowed = 0.0 if inner else max(depth, TOUCH) if gives else TOUCH
            assert distance > -allowed - 1e-6, (first, second)


@pytest.mark.parametrize("name", ["left_arm", "right_arm", "left_leg", "right_leg"])
def test_contacts_at_a_wall_are_true(person, at_wall, name):
    q = person.standing_posture()
    answer = at_wall.request(q, name, PUSH)
    assert answer.found, answer.message
    check(person, wall_scene(), answer, q, limb_named(person, name))


@given(st.floats(-0.15, 0.1), st.floats(-0.2, 0.2), st.floats(-0.4, 0.4), st.integers(0, 5))
def test_whatever_is_found_is_true(person, at_wall, x, y, yaw, number):
    limb = person.limbs[number]
    move = np.zeros(person.nv)
    move[:2], move[5] = (x, y), yaw
    q = integrate(person, person.standing_posture(), move)
    answer = at_wall.request(q, limb.name, PUSH)
    assert answer.found == (answer.failure is None) == (answer.message == "")
    if answer.found:
        check(person, wall_scene(), answer, q, limb)


def test_an_open_mesh_is_touched_and_not_gone_through(person, person_samples):
    """A wall of two triangles has no inside: hands find the same kind of contact as on a box, none behind."""
    corners = np.array([[0.5, -1.5, 0.0], [0.5, 1.5, 0.0], [0.5, 1.5, 3.0], [0.5, -1.5, 3.0]])
    sheet = Obstacle("wall", Mesh(corners, np.array([[0, 2, 1], [0, 3, 2]])))
    generator = ContactGenerator(person, Scene([sheet], floor_height=None), person_samples)
    answer = generator.request(person.standing_posture(), "right_arm", PUSH)
    assert answer.found, answer.message
    assert answer.contact.position[0] == pytest.approx(0.5, abs=1e-3)
    assert answer.contact.normal @ [-1.0, 0.0, 0.0] == pytest.approx(1.0, abs=1e-6)
    state = Configuration(person, answer.q)
    for segment in ("right_upper_arm", "right_forearm"):
        assert state.point(segment, [0.0, 0.0, 0.0])[0] < 0.5


def test_hands_that_push_go_to_the_wall_and_not_to_the_table(person, person_samples):
    """EFORT against the closest surface: a table under the hands, a wall before them."""
    table = Obstacle("table", Box((0.4, 3.0, 0.05)), translation=(0.3, 0.0, 0.85))
    scene = Scene([*wall_scene().obstacles[1:], table])
    generator = ContactGenerator(person, scene, person_samples)
    q = person.standing_posture()
    pushing = generator.request(q, "right_arm", PUSH)
    closest = generator.request(q, "right_arm", PUSH, ClosestDistance())
    assert (pushing.obstacle, closest.obstacle) == ("wall", "table")
    rising = generator.request(q, "right_arm", UP)
    assert rising.obstacle == "table"


def test_no_answer_has_less_than_the_usable_efort(person):
    """Who sits before a backrest and looks for help upwards gets none from its upright face.

    Random directions, heuristics and limbs on a chair: what is found is usable, or the best is said.
    """
    chair = [SEAT, Obstacle("back", Box((0.05, 0.5, 0.5)), translation=(-0.3, 0.0, 0.7))]
    scene, q, rng = Scene(chair), sitting(person), np.random.default_rng(4)
    asked = [ContactQuestion.of("left_arm", (0.0, 0.0, 1.0), role="body", samples=2000)]
    asked += [
        ContactQuestion.of(
            person.limbs[rng.integers(6)].name, tuple(rng.normal(size=3)),
            heuristic=("efort", "distance", "random")[number % 3], samples=500, seed=number,
        )
        for number in range(18)
    ]  # fmt: skip
    causes = set()
    for question in asked:
        answer = find_contact(person, scene, q, question)
        assert answer.usable == usable_efort(person, limb_named(person, question.limb)) > 0.1
        if answer.result.found:
            assert answer.efort >= answer.usable
        causes.add(answer.result.failure)
        if answer.result.failure is Hindrance.DIRECTION:
            assert "the best EFORT is" in answer.result.message
            assert f"usable {answer.usable:.2g}" in answer.result.message
    assert causes >= {None, Hindrance.DIRECTION}


def random_boxes(q, rng):
    """Up to ten boxes of any heading around a body, every fourth of them leaning, on the floor."""
    size, boxes = float(q[2]), []
    for number in range(rng.integers(1, 11)):
        lean = rng.uniform(-0.5, 0.5, 2) if number % 4 == 3 else np.zeros(2)
        away, angle = size * rng.uniform(0.3, 0.9), rng.uniform(-np.pi, np.pi)
        place = (q[0] + away * np.cos(angle), q[1] + away * np.sin(angle), size * rng.uniform(0.0, 1.8))
        turn = rotation_from_rpy(*lean, rng.uniform(-np.pi, np.pi))
        boxes.append(Obstacle(f"box{number}", Box(size * rng.uniform(0.05, 0.7, 3)), turn, place))
    return Scene(boxes)


def turned(body, rng):
    move = np.zeros(body.nv)
    move[5] = rng.uniform(-np.pi, np.pi)
    return integrate(body, body.standing_posture(), move)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_the_efort_of_every_answer_is_usable_and_that_of_its_posture(seed, person, creature):
    """Any limb, scene, direction, role, heuristic and way to touch: anew from the posture's Jacobian."""
    rng, found = np.random.default_rng(seed), 0
    for number in range(30):
        body = creature if number % 4 == 3 else person
        q = turned(body, rng)
        limb = body.limbs[rng.integers(len(body.limbs))]
        pulls = bool(limb.name.endswith("arm") and rng.integers(2))
        question = ContactQuestion.of(
            limb.name, tuple(rng.normal(size=3)), role=("auto", "body", "object")[rng.integers(3)],
            pulling=pulls, heuristic=HEURISTICS[number % 4], samples=600, seed=int(rng.integers(1000)),
        )  # fmt: skip
        answer = find_contact(body, random_boxes(q, rng), q, question)
        assert answer.usable == usable_efort(body, limb)
        if not answer.result.found:
            assert answer.efort is None
            assert answer.result.message
            continue
        found += 1
        assert answer.efort >= answer.usable > 0.0
        chain, state = LimbKinematics(body, limb), Configuration(body, answer.result.q)
        situation = Situation.of(state, limb, np.zeros(3))
        jacobian = situation.rotation @ chain.place(answer.result.q[chain.slots][None]).jacobians[0]
        v = Task(question.task, {limb.name} if answer.role == "object" else ()).reaction_on(limb.name)
        ratio = (v @ jacobian @ jacobian.T @ v) ** -0.5
        alpha = (-1.0 if pulls else 1.0) * ratio * (v @ answer.result.contact.normal)
        assert answer.efort == pytest.approx(alpha, rel=1e-6)
    assert found >= 5


def exhaustive(generator, scene, q, limb, samples, task, usable):
    """The same request without trees, bounds and early ends: all samples on all surfaces, tried in order."""
    body, settings = generator.body, generator.settings
    situation = Situation.of(Configuration(body, q), limb, task.reaction_on(limb.name))
    flat, chain = limb.kind is ContactKind.SOLE, LimbKinematics(body, limb)
    sole = footprint(body, limb, limb.kind, generator.rules)
    places, turns = situation.to_world(samples.positions), situation.rotation @ samples.rotations
    rows, points = [], []
    for number, surface in enumerate(scene.surfaces):
        height = surface.height(places)
        lies = (np.abs(height) <= settings.tolerance) & (
            turns[:, :, 2] @ surface.normal >= np.cos(settings.max_tilt)
        )
        for row in np.flatnonzero(lies).tolist():
            point = places[row] - height[row] * surface.normal
            if surface.holds(point[None] + sole @ turns[row].T).all() and surface.holds(point[None])[0]:
                rows.append((row, number))
                points.append(point)
    points = [points[k] for k in sorted(range(len(rows)), key=rows.__getitem__)]
    rows = sorted(rows)
    normals = np.array([scene.surfaces[number].normal for _, number in rows]).reshape(-1, 3)
    v = situation.reaction @ situation.rotation
    values = efort(samples.products[[row for row, _ in rows]], v, normals @ situation.rotation)
    good = np.flatnonzero(values >= usable.least)
    collisions = LimbCollisions(body, limb, scene)
    aligner, allowed = Aligner(chain), 1e-4 if flat else settings.point_tilt
    for k in good[_order(values[good])].tolist():
        (row, number), local = rows[k], (points[k] - situation.origin) @ situation.rotation
        found = aligner.align(samples.angles[row], local, normals[k] @ situation.rotation, allowed)
        changed, turn = np.array(q), situation.rotation @ found.rotation
        changed[chain.slots] = found.angles
        alpha = efort(found.product[None], v, (normals[k] @ situation.rotation)[None])[0]
        if not found.lies(allowed) or alpha < usable.least:
            continue
        if flat and not scene.surfaces[number].holds(points[k] + sole @ turn.T).all():
            continue
        touched = scene.surfaces[number].obstacles
        if collisions.first(changed, touched) is None:
            return changed, touched
    return None


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2, 3))])
def test_a_request_has_the_answer_of_an_exhaustive_search(seed, person, creature):
    """Trees of samples, bounds of surfaces, and what is known to collide change no answer."""
    rng, found = np.random.default_rng(seed), 0
    for number in range(12):
        body = creature if number % 4 == 3 else person
        q = turned(body, rng)
        limb, scene = body.limbs[rng.integers(len(body.limbs))], random_boxes(q, rng)
        samples, task = sample_limb(body, limb, rng, 1000), Task(rng.normal(size=3))
        usable = UsableEfort(usable_efort(body, limb))
        generator = ContactGenerator(body, scene, {limb.name: samples}, GeneratorSettings(tries=10_000))
        answer = generator.request(q, limb.name, task, usable=usable)
        wanted = exhaustive(generator, scene, q, limb, samples, task, usable)
        assert answer.found == (wanted is not None), answer.message
        if wanted is not None:
            np.testing.assert_allclose(answer.q, wanted[0], rtol=0.0, atol=1e-9)
            assert answer.obstacles == wanted[1]
            found += 1
    assert found >= 3


def test_a_limb_that_begins_in_a_box_is_said_to_collide(creature, creature_samples):
    """A box about the hip: every posture collides there, wherever the sample."""
    limb, q = creature.limbs[0], creature.standing_posture()
    hip = Situation.of(Configuration(creature, q), limb, np.zeros(3)).origin
    scene = Scene([Obstacle("box", Box((0.03, 0.03, 0.03)), translation=hip)])
    answer = ContactGenerator(creature, scene, creature_samples).request(q, limb.name, UP)
    assert answer.failure is Hindrance.COLLISION
    assert answer.message.endswith("_femur/femur in box")
    collisions, chain = LimbCollisions(creature, limb, scene), LimbKinematics(creature, limb)
    for angles in chain.random_angles(np.random.default_rng(1), 50):
        q[chain.slots] = angles
        assert collisions.first(q) is not None


def test_what_is_over_a_hole_is_on_no_surface():
    """A slab with a hole of 1.2 m by 0.5 m and nothing in it."""
    ring = [
        Obstacle(f"side{k}", Box((1.0, 3.0, 0.1) if k < 2 else (1.2, 1.0, 0.1)), translation=at)
        for k, at in enumerate([(1.1, 0, 0.0), (-1.1, 0, 0.0), (0.0, 0.75, 0.0), (0.0, -0.75, 0.0)])
    ]
    surfaces = Scene(ring, None).surfaces_facing((0.0, 0.0, 1.0), 0.1)
    whole = int(np.argmax([item.area for item in surfaces]))
    assert surfaces[whole].holes
    points = np.random.default_rng(0).uniform((-1.8, -1.4, 0.05), (1.8, 1.4, 0.05), (300, 3))
    x, y = np.abs(points[:, :2].T)
    inside = (x < 1.6) & (y < 1.25) & ((x > 0.6) | (y > 0.25))
    middle = (x < 0.6) & (y < 1.25)  # the sides are longer than what is between them
    over = SurfaceTable(surfaces).over(points, np.full(300, whole))
    np.testing.assert_array_equal(over[middle], inside[middle])


def test_a_nearer_surface_that_does_not_push_is_no_answer(person, person_samples):
    """By the closest distance alone a pushing hand goes to the table under it, which pushes it up."""
    table = Obstacle("table", Box((0.4, 3.0, 0.05)), translation=(0.3, 0.0, 0.85))
    generator = ContactGenerator(person, Scene([*wall_scene().obstacles[1:], table]), person_samples)
    usable = UsableEfort(usable_efort(person, limb_named(person, "right_arm")))
    asked = person.standing_posture(), "right_arm", PUSH, ClosestDistance()
    assert generator.request(*asked).obstacle == "table"
    answer = generator.request(*asked, usable=usable)
    assert answer.obstacle == "wall"
    assert answer.efort >= usable.least


def test_without_its_own_direction_a_pushing_hand_would_score_negative(person, at_wall):
    q = person.standing_posture()
    assert at_wall.request(q, "left_arm", PUSH).score > 0.0
    assert at_wall.request(q, "left_arm", Task((1.0, 0.0, 0.0))).score < 0.0


def test_a_hand_can_grasp_and_pull(person, at_wall):
    q = person.standing_posture()
    task = Task((-1.0, 0.0, 0.0), {"left_arm"})
    answer = at_wall.request(q, "left_arm", task, Efort(pulling=True), kind=ContactKind.GRASP)
    assert answer.found
    assert answer.score > 0.0
    assert answer.contact.kind is ContactKind.GRASP
    assert answer.contact.max_force == ContactRules().grasp_force


@pytest.mark.long
def test_the_same_request_has_the_same_answer(person, person_samples, at_wall):
    q = person.standing_posture()
    for heuristic in (Efort(), Random(1)):
        first = at_wall.request(q, "left_leg", PUSH, heuristic)
        at_wall.request(q, "left_arm", PUSH)
        second = ContactGenerator(person, wall_scene(), person_samples).request(
            q, "left_leg", PUSH, heuristic
        )
        assert np.array_equal(first.q, second.q)
        assert first.score == second.score


def test_an_insect_stands_on_books(creature, creature_samples):
    books = [
        Obstacle(f"book{n}", Box((0.06, 0.5, 0.03 + 0.02 * (n % 3))), translation=(-0.6 + 0.065 * n, 0, 0.02))
        for n in range(19)
    ]
    scene = Scene(books)
    generator = ContactGenerator(creature, scene, creature_samples)
    q = creature.standing_posture()
    q[2] += 0.06
    for limb in creature.limbs:
        answer = generator.request(q, limb.name, Task((1.0, 0.0, 0.5)))
        assert answer.found, answer.message
        check(creature, scene, answer, q, limb)


def test_a_knee_is_put_on_a_step(person, person_samples):
    step = Obstacle("step", Box((0.5, 1.0, 0.45)), translation=(0.35, 0.0, 0.225))
    scene = Scene([step])
    generator = ContactGenerator(person, scene, person_samples)
    q = person.standing_posture()
    q[2] -= 0.02
    answer = generator.request(q, "left_knee", UP)
    assert answer.found, answer.message
    assert answer.obstacle == "step"
    check(person, scene, answer, q, limb_named(person, "left_knee"))


def test_nothing_in_reach_is_said(person, person_samples):
    answer = ContactGenerator(person, wall_scene(5.0), person_samples).request(
        person.standing_posture(), "left_arm", PUSH
    )
    assert answer.failure is Hindrance.REACH
    assert answer.message == "no surface is within reach of left_arm"
    empty = ContactGenerator(person, Scene([], None), person_samples)
    assert empty.request(person.standing_posture(), "left_leg", UP).failure is Hindrance.REACH


def test_no_sample_on_a_surface_is_said(person, person_samples):
    """A ledge narrower than a sole."""
    ledge = Obstacle("ledge", Box((0.05, 0.05, 0.05)), translation=(0.2, 0.1, 0.2))
    generator = ContactGenerator(person, Scene([ledge], None), person_samples)
    answer = generator.request(person.standing_posture(), "left_leg", UP)
    assert answer.failure is Hindrance.SURFACE
    assert "a surface of ledge" in answer.message


def test_collisions_are_said_with_the_names_of_both(person, person_samples):
    """A wall behind a lattice of bars too narrow for an arm."""
    bars = [
        Obstacle(f"bar{n}", Capsule(0.02, 3.0), translation=(0.3, -0.8 + 0.08 * n, 1.5)) for n in range(24)
    ]
    scene = Scene([*wall_scene(0.45).obstacles[1:], *bars], None)
    loose = GeneratorSettings(point_tilt=1.0)
    generator = ContactGenerator(person, scene, person_samples, loose)
    answer = generator.request(person.standing_posture(), "left_arm", PUSH)
    assert answer.failure is Hindrance.COLLISION
    assert " in bar" in answer.message
    assert answer.q is None
    assert answer.tried > 0


def test_effectors_that_cannot_lie_flat_are_said(person, person_samples):
    """Steps of a ceiling's slope that no ankle can follow, allowed in only by a wide filter."""
    tilt = rotation_from_rpy(0.0, np.deg2rad(-80.0), 0.0)
    slope = Obstacle("slope", Box((1.0, 3.0, 0.05)), tilt, (0.55, 0.0, 0.2))
    settings_ = GeneratorSettings(max_tilt=1.5, tries=10)
    generator = ContactGenerator(person, Scene([slope], None), person_samples, settings_)
    answer = generator.request(person.standing_posture(), "left_leg", Task((0.0, 0.0, -1.0)))
    assert not answer.found
    assert answer.failure in (Hindrance.ALIGNMENT, Hindrance.COLLISION)
    assert answer.message.startswith("none of ")


def test_misuse_is_refused(person, person_samples, creature, creature_samples):
    arm = {"left_arm": person_samples["left_arm"]}
    generator = ContactGenerator(person, wall_scene(), arm)
    with pytest.raises(BodyError, match="no samples of limb 'right_arm'; valid: left_arm"):
        generator.request(person.standing_posture(), "right_arm", PUSH)
    with pytest.raises(BodyError, match="shape"):
        generator.request(np.zeros(3), "left_arm", PUSH)
    insects = ContactGenerator(creature, wall_scene(), creature_samples)
    q = creature.standing_posture()
    with pytest.raises(ContactError, match="has no soles"):
        insects.request(q, "left_front_leg", UP, kind=ContactKind.SOLE)


# --- parts ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [human, insect])
def test_alignment_reaches_what_can_be_reached(make):
    """Targets taken from other samples nearby: position and normal to the tolerance, ranges kept."""
    body = make()
    chain = LimbKinematics(body, body.limbs[0])
    rng = np.random.default_rng(5)
    angles = chain.lower + (0.3 + 0.4 * rng.random((60, len(chain)))) * (chain.upper - chain.lower)
    goal = chain.place(np.clip(angles + rng.uniform(-0.15, 0.15, angles.shape), chain.lower, chain.upper))
    aligner, normals = Aligner(chain), goal.rotations[:, :, 2]
    found = [aligner.align(*row) for row in zip(angles, goal.positions, normals, strict=True)]
    assert np.mean([item.lies(1e-4) for item in found]) > 0.9
    reached = np.array([item.angles for item in found])
    assert ((reached >= chain.lower) & (reached <= chain.upper)).all()
    placed = chain.place(reached)
    errors, tilts = [item.error for item in found], [item.tilt for item in found]
    assert np.allclose(np.linalg.norm(placed.positions - goal.positions, axis=1), errors)
    assert np.allclose(np.cos(tilts), np.einsum("ni,ni->n", placed.rotations[:, :, 2], normals), atol=1e-12)
    assert np.allclose(placed.rotations, [item.rotation for item in found])


def test_alignment_turns_an_effector_that_looks_the_wrong_way():
    """Half a turn, where the axis of the turn is not unique, gives finite steps."""
    body = human()
    chain = LimbKinematics(body, body.limbs[0])
    angles = 0.5 * (chain.lower + chain.upper)
    placed = chain.place(angles[None])
    found = Aligner(chain).align(angles, placed.positions[0], -placed.rotations[0, :, 2])
    assert np.isfinite(found.angles).all()
    assert found.tilt < np.pi


def test_a_step_is_that_of_damped_least_squares():
    """The compiled step against the Jacobian of the chain, some joints at the end of their ranges."""
    chain = LimbKinematics(human(), human().limbs[0])
    rng = np.random.default_rng(2)
    step = AlignmentStep(chain, level=True)
    for number, q in enumerate(chain.random_angles(rng, 20)):
        q[number % len(chain)] = (chain.lower, chain.upper)[number % 2][number % len(chain)]
        placed = chain.place(q[None])
        z, normal = placed.rotations[0, :, 2], rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        gap = rng.normal(size=3) * 0.02
        step.q[:], step.point[:], step.normal[:] = q, placed.positions[0] + gap, normal
        error, tilt = step()
        assert np.isclose(error, np.linalg.norm(gap))
        assert np.isclose(np.cos(tilt), z @ normal)
        turn = np.cross(z, normal)
        turn *= tilt / np.linalg.norm(turn)
        axes = placed.axes[0]
        jacobian = np.vstack([placed.jacobians[0], LEVER * (axes - np.outer(z, z @ axes))])
        wanted = np.concatenate([gap, LEVER * turn])
        pull = jacobian.T @ wanted
        held = ((q <= chain.lower) & (pull < 0.0)) | ((q >= chain.upper) & (pull > 0.0))
        free = np.where(held, 0.0, jacobian)
        move = free.T @ np.linalg.solve(free @ free.T + DAMPING**2 * np.eye(6), wanted)
        expected = np.clip(q + np.clip(move, -LARGEST_STEP, LARGEST_STEP), chain.lower, chain.upper)
        assert np.allclose(step.moved, expected, atol=1e-8)


def test_candidates_are_all_samples_near_a_surface(person, person_samples):
    """The index and the filters together, against a test of every sample on every surface."""
    ramp = Obstacle("ramp", Box((0.6, 0.8, 0.1)), rotation_from_rpy(0.1, -0.4, 0.2), (0.4, 0.1, 0.9))
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 0.2, 0], [0, 1, 0]]) * 0.5 + [0.2, -0.2, 1.1]
    bent = Surface(("bent",), corner, np.array([0.0, 0.0, 1.0]))
    surfaces = (*Scene([ramp]).surfaces, bent)
    samples = person_samples["left_arm"]
    state = Configuration(person, person.standing_posture())
    situation = Situation.of(state, samples.limb, np.array([0.0, 0.0, 1.0]))
    table = SurfaceTable(surfaces)
    near = table.within_reach(situation.rotation, situation.origin, *samples.hull, 0.03)
    found = find_candidates(
        table, near, situation, samples, tolerance=0.03, max_tilt=0.7, footprint=np.zeros((1, 3))
    )
    places = situation.to_world(samples.positions)
    up = samples.rotations[:, :, 2] @ situation.rotation.T
    wanted = {
        (row, number)
        for number, surface in enumerate(surfaces)
        for row in np.flatnonzero(
            (np.abs(surface.height(places)) <= 0.03)
            & (up @ surface.normal >= np.cos(0.7))
            & (surface.outside(places) == 0.0)
        ).tolist()
    }
    assert set(zip(found.samples.tolist(), found.surfaces.tolist(), strict=True)) == wanted
    assert len(surfaces) - 1 in found.surfaces
    heights = [surfaces[n].height(p[None])[0] for n, p in zip(found.surfaces, found.points, strict=True)]
    assert np.abs(heights).max() < 1e-9


def test_the_collision_test_agrees_with_distances(person):
    """Random arms in a small room with a mesh, against the distances of all pairs."""
    pyramid = Mesh(
        np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]], dtype=float),
        np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
    )
    scene = Scene([*wall_scene(0.35).obstacles[1:], Obstacle("rock", pyramid, translation=(0.1, 0.3, 0.9))])
    limb = limb_named(person, "left_arm")
    test, near = LimbCollisions(person, limb, scene), Proximity(person, scene)
    chain = LimbKinematics(person, limb)
    free = 0
    for angles in chain.random_angles(np.random.default_rng(6), 150):
        q = person.standing_posture()
        q[chain.slots] = angles
        result = near.evaluate(q, 0.1)
        depths = [
            distance if "/" in other else distance + TOUCH
            for (name, other), distance in zip(result.pairs, result.distance, strict=True)
            if {name.split("/")[0], other.split("/")[0]} & set(limb.segments)
        ]
        least = min(depths, default=1.0)
        if abs(least) > 1e-4:
            assert (test.first(q) is not None) == (least < 0.0), (test.first(q), least)
        free += test.first(q) is None
    assert 10 < free < 140


def test_contacts_of_natural_samples_are_natural(person):
    """Hands and feet on a wall are within learnt ranges, but for the slack of the alignment."""
    samples = sample_limbs(person, np.random.default_rng(0), 5000, natural=True)
    generator = ContactGenerator(person, wall_scene(0.45), samples)
    found = 0
    for number in range(12):
        q = person.standing_posture()
        q[0] -= 0.02 * number
        for name in ("left_arm", "right_leg"):
            answer = generator.request(q, name, PUSH)
            if answer.found:
                limb = limb_named(person, name)
                angles = answer.q[limb_slots(person, limb)]
                assert NaturalRange(person, limb).volume_distance(angles[None])[0] >= -NATURAL_SLACK
                found += 1
    assert found >= 8


def test_what_a_limb_cannot_reach_is_left_out_and_nothing_else(person):
    """The collision test after ``begin`` against the one without, at many places of the root."""
    rng = np.random.default_rng(8)
    scene = Scene(
        [Obstacle(f"box{n}", Box((0.2, 0.2, 0.2)), translation=rng.uniform(-1, 2, 3)) for n in range(15)]
    )
    limb = limb_named(person, "right_arm")
    chain = LimbKinematics(person, limb)
    pruned, plain = LimbCollisions(person, limb, scene), LimbCollisions(person, limb, scene)
    hits = 0
    for _ in range(15):
        move = np.concatenate([rng.uniform(-0.6, 0.6, 3), rng.uniform(-1, 1, 3), np.zeros(person.nv - 6)])
        q = integrate(person, person.standing_posture(), move)
        pruned.begin(q, limb_placement(Configuration(person, q), limb)[1])
        for angles in chain.random_angles(rng, 20):
            q[chain.slots] = angles
            found = plain.first(q)
            assert pruned.first(q) == found
            hits += found is not None
    assert 30 < hits < 290


@given(st.integers(1, 3000))
def test_tries_are_distinct_and_go_down_the_order_in_longer_steps(count):
    """Down the scores in steps that never get shorter; then what was left out, best first."""
    scores = np.random.default_rng(count).random(count)
    rows = _order(scores)
    assert sorted(rows.tolist()) == list(range(count))
    ranks = np.argsort(np.argsort(-scores))[rows]
    assert ranks[0] == 0
    turns = np.flatnonzero(np.diff(ranks) < 0)
    assert len(turns) <= 1
    first = ranks[: turns[0] + 1] if len(turns) else ranks
    assert (np.diff(first, 2) >= 0).all()
    assert (np.diff(ranks[len(first) :]) > 0).all()


# --- samples deep in something -------------------------------------------------------------------


SEAT = Obstacle("seat", Box((0.45, 0.5, 0.05)), translation=(-0.05, 0.0, 0.42))


def chair_scene():
    """A seat between the legs of who sits on it and the floor."""
    return Scene(
        [
            SEAT,
            Obstacle("ball", Sphere(0.1), translation=(0.35, 0.25, 0.6)),
            Obstacle("post", Capsule(0.04, 0.5), translation=(0.3, -0.1, 0.3)),
        ]
    )


def sitting(body):
    bent = {"hip_flexion": 1.4, "knee_flexion": 1.5, "elbow_flexion": 0.5}
    q = body.posture({f"{side}_{name}": bent[name] for side in ("left", "right") for name in bent})
    q[2] = 0.58
    return q


def test_a_sample_is_deep_where_a_ball_along_its_limb_is(person, person_samples):
    """Against Coal's distance of each ball to everything that the limb is tested with.

    What is named is a pair in which the whole capsule is as deep as well: a ball is within it.
    """
    scene, q, depth = chair_scene(), sitting(person), 0.03
    proximity, samples = Proximity(person, scene), person_samples["left_leg"]
    collisions = LimbCollisions(person, samples.limb, scene)
    deep = DeepSamples(person, LimbKinematics(person, samples.limb), samples, collisions)
    situation = Situation.of(Configuration(person, q), samples.limb, np.array([0.0, 0.0, 1.0]))
    collisions.begin(situation.state.q, situation.origin)
    rows = np.arange(150)
    found = deep.pairs(deep.around(situation.rotation, situation.origin), rows, depth)
    others = {collisions.names[pair][1] for pair in found[found >= 0].tolist()}
    assert others >= {"seat", "ball", "post"}
    assert any("/" in name for name in others)
    shapes = {shape.name: shape for shape in collisions.shapes}
    slots = limb_slots(person, samples.limb)
    for row, pair in zip(rows.tolist(), found.tolist(), strict=True):
        q[slots] = samples.angles[row]
        state, depths = Configuration(person, q), []
        for name, other in (collisions.names[number] for number in np.flatnonzero(collisions.active)):
            if name not in deep.shapes or other in (*deep.shapes, "floor"):
                continue
            capsule = next(s for s in person.segment(name.split("/")[0]).shapes if name.endswith(s.name))
            turn, place = state.segment_placement(name.split("/")[0])
            thing = next(s for label, s in shapes.items() if label.split("#")[0] == other)
            if "/" in other:
                own = person.segment(other.split("/")[0])
                frame, origin = state.segment_placement(own.name)
                shape = next(s for s in own.shapes if other.endswith(s.name))
                there = coal.Transform3s(frame @ shape.rotation, origin + frame @ shape.translation)
            else:
                there = coal.Transform3s(
                    np.array(thing.placement.rotation), np.array(thing.placement.translation)
                )
            measure = pair_meter(coal.Sphere(capsule.size[0]), thing.geometry)
            for share in (0.0, 0.5):
                centre = capsule.translation + share * capsule.size[1] * capsule.rotation[:, 2]
                ball = coal.Transform3s(np.eye(3), place + turn @ centre)
                depths.append(-measure(ball, there, np.inf)[0])
        if abs(max(depths) - depth) > 1e-5:
            assert (pair >= 0) == (max(depths) > depth)
        if pair >= 0:
            exact = proximity.evaluate(q, activation=0.0)
            same = [set(names) == set(collisions.names[pair]) for names in exact.pairs]
            assert exact.distance[same].min() < -depth + 1e-6


def test_leaving_deep_samples_out_changes_no_answer(person, person_samples, monkeypatch):
    """Who sits finds the same places for the feet, with and without, but tries fewer."""
    rng = np.random.default_rng(3)
    generator = ContactGenerator(person, Scene([SEAT]), person_samples)
    places = [sitting(person) for _ in range(8)]
    for q in places:
        q[:2] += rng.uniform(-0.1, 0.1, 2)

    def answers():
        return [generator.request(q, f"{side}_leg", UP) for q in places for side in ("left", "right")]

    quick = answers()
    for tools in generator._tools.values():
        monkeypatch.setattr(tools.deep, "shapes", frozenset())
    slow = answers()
    both = [(a, b) for a, b in zip(quick, slow, strict=True) if b.found]
    assert len(both) > len(slow) // 2
    for a, b in both:
        assert a.score == b.score
        assert np.array_equal(a.q, b.q)
    assert np.mean([a.tried for a, _ in both]) < 0.5 * np.mean([b.tried for _, b in both])


@pytest.mark.parametrize(
    ("name", "limb", "task"), [("climb-wall", "left_arm", UP), ("stairs", "right_leg", UP)]
)
@pytest.mark.parametrize("heuristic", ["efort", "distance", "random"])
def test_the_answer_for_a_moved_scenario_is_the_moved_answer(name, limb, task, heuristic):
    """Places to rounding of coordinates of 10 m; efforts in 1/N.m of any size to 1e-9 of theirs."""
    transform, answers = PlanarTransform(10.0, -7.0, 37.0), []
    for scenario, turn in (
        (load_scenario(name), PlanarTransform()),
        (load_scenario(name).moved(10.0, -7.0, 37.0), transform),
    ):
        body, scene = scenario.build_body(), scenario.build_scene()
        question = ContactQuestion.of(
            limb, tuple(turn.directions(task.direction)), heuristic=heuristic, samples=1000
        )
        q = start_posture(scenario, body, scene)
        answers.append(find_contact(body, scene, q, question, contact_rules(scenario, body)).as_dict())
    here, there = answers
    assert here["found"]
    assert there["found"]
    assert there["candidates"] == here["candidates"]
    np.testing.assert_allclose(there["position"], transform.points(here["position"]), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(there["normal"], transform.directions(here["normal"]), rtol=0.0, atol=1e-12)
    assert there["efort"] == pytest.approx(here["efort"], rel=1e-9)
