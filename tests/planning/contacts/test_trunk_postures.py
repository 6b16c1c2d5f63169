"""Postures of the trunk: between which walls and under which ceilings they are free."""

from itertools import pairwise

import coal
import numpy as np
import pytest

from manikin.body import human, with_further_contacts
from manikin.contact import point
from manikin.kinematics import trunk_postures
from manikin.kinematics.trunk_postures import CEILINGS, SKIN, TrunkClearance, TrunkPosture, TrunkPostures
from manikin.planning.contacts import PostureFinder
from manikin.scene import Box, Cylinder, Obstacle, Scene
from manikin.scene.collision import collision_parts, part_meter


@pytest.fixture(scope="module")
def postures() -> TrunkPostures:
    """Postures of an average man."""
    return TrunkPostures.of(human())


def passage(width: float, height: float = 2.5) -> Scene:
    """Two walls one metre long along x, and a ceiling on them."""
    walls = [
        Obstacle(name, Box((1.0, 1.0, 2.0)), translation=(0.0, sign * 0.5 * (width + 1.0), 1.0))
        for name, sign in (("left", 1.0), ("right", -1.0))
    ]
    top = Obstacle("top", Box((1.0, 3.0, 0.5)), translation=(0.0, 0.0, height + 0.25))
    return Scene([*walls, top])


@pytest.mark.parametrize(("width", "heading"), [(0.80, 0.0), (0.55, 0.0), (0.42, 0.0), (0.40, 0.5 * np.pi)])
def test_body_passes_gaps_that_people_pass(postures: TrunkPostures, width: float, heading: float) -> None:
    """Arms close or the trunk turned for 0.42 m, sideways for 0.40 m."""
    places = np.array([[x, 0.0, 0.0, heading] for x in (-0.6, -0.2, 0.0, 0.3)])
    assert TrunkClearance(postures, passage(width)).free(places).any(axis=1).all()


def test_arms_are_no_part_of_a_rigid_trunk(postures: TrunkPostures) -> None:
    """Where hanging arms meet the walls, arms held close do not."""
    free = TrunkClearance(postures, passage(0.60)).free(np.zeros((1, 4)))[0]
    names = [item.name for item in postures]
    assert not free[names.index("upright")]
    assert free[names.index("arms close")]


@pytest.mark.parametrize("height", [1.60, 1.35, 1.10, 0.97])
def test_cheapest_posture_is_no_lower_than_it_must(postures: TrunkPostures, height: float) -> None:
    """Under a ceiling the body stoops, and no deeper than to the next posture below it."""
    chosen = postures[TrunkClearance(postures, passage(1.2, height)).cheapest(np.zeros((1, 4)))[0]]
    assert height - 0.17 < chosen.height < height


@pytest.mark.parametrize(
    ("stature", "mass", "sex"),
    [(1.52, 56.2, "female"), (1.60, 60.0, "female"), (1.68, 71.7, "male"), (1.86, 72.6, "female")],
)
def test_everybody_bends_to_the_lowest_ceiling(stature: float, mass: float, sex: str) -> None:
    """Bodies that a search from straight legs alone does not bend; each ceiling is kept by the skin."""
    body = human(stature=stature, mass=mass, sex=sex)
    heights = sorted(item.height / stature for item in TrunkPostures.of(body) if "bent" in item.name)
    assert len(heights) == len(CEILINGS)
    assert (np.array(heights) <= np.sort(CEILINGS) - SKIN / stature + 1e-3).all()


def test_nothing_passes_where_nobody_would(postures: TrunkPostures) -> None:
    """No posture is free in a gap of 0.28 m or under 0.7 m."""
    for scene in (passage(0.28), passage(1.2, 0.7)):
        assert (TrunkClearance(postures, scene).cheapest(np.zeros((1, 4))) == -1).all()


def test_quick_test_agrees_with_measured_distances(postures: TrunkPostures) -> None:
    """Same answers as exact distances of every shape to every part; places may be asked one by one."""
    rng = np.random.default_rng(3)
    solids = [
        Obstacle(f"box {n}", Box(rng.uniform(0.1, 0.8, 3)), translation=rng.uniform((-2, -2, 0), (2, 2, 2)))
        for n in range(6)
    ]
    scene = Scene([*solids, Obstacle("post", Cylinder(0.1, 2.0), translation=(0.5, 0.2, 1.0))])
    places = np.column_stack([rng.uniform(-2, 2, (12, 2)), np.zeros(12), rng.uniform(-3, 3, 12)])
    checker = TrunkClearance(postures, scene)
    free = checker.free(places)
    parts = [part for item in scene for part in collision_parts(item)]
    for place, answers in zip(places, free, strict=True):
        cosine, sine = np.cos(place[3]), np.sin(place[3])
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        for posture, answer in zip(postures, answers, strict=True):
            shapes = zip(posture.shapes, posture.rotations, posture.translations, strict=True)
            nearest = min(
                part_meter(shape, part)(
                    coal.Transform3s(turn @ rotation, turn @ centre + place[:3]),
                    coal.Transform3s(part.rotation, part.translation),
                    np.inf,
                )[0]
                for shape, rotation, centre in shapes
                for part in parts
            )
            assert answer == (nearest >= checker.margin)
    alone = TrunkClearance(postures, scene)
    assert np.array_equal(np.vstack([alone.free(row) for row in places]), free)


def test_a_body_that_passes_upright_needs_no_other_posture(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a wall and on open ground no further posture is looked for, and the answers are upright."""

    def refused(*_: object, **__: object) -> None:
        raise AssertionError("a posture is looked for")

    monkeypatch.setattr(trunk_postures, "generate_posture", refused)
    wall = Obstacle("wall", Box((4.0, 0.2, 3.0)), translation=(0.0, 0.9, 1.5))
    clearance = TrunkClearance(TrunkPostures.of(human(stature=1.71)), Scene([wall]))
    places = np.array([[x, 0.0, 0.0, 0.1 * x] for x in np.arange(-1.0, 1.0, 0.2)])
    assert (clearance.cheapest(places) == 0).all()
    way = clearance.along(places)
    assert way is not None
    assert (way == 0).all()


def test_body_bends_before_a_bar_and_not_below_it(postures: TrunkPostures) -> None:
    """Along a way under a bar, changes of posture are free, and the ends are upright."""
    bar = Obstacle("bar", Box((0.2, 4.0, 0.2)), translation=(1.2, 0.0, 1.15))
    clearance = TrunkClearance(postures, Scene([bar]))
    places = np.array([[x, 0.0, 0.0, 0.0] for x in np.arange(0.0, 2.6, 0.15)])
    way = clearance.along(places)
    assert way is not None
    assert clearance.free(places)[np.arange(len(places)), way].all()
    assert postures[way[0]].name == postures[way[-1]].name == "upright"
    free = clearance.free(places)
    for number, (before, after) in enumerate(pairwise(way)):
        low, high = sorted((postures[before].height, postures[after].height))
        passed = [before, after] + [
            row for row, item in enumerate(postures) if low + 0.02 < item.height < high - 0.02
        ]
        assert before == after or free[number, passed].all() or free[number + 1, passed].all()
    wall = Obstacle("wall", Box((0.2, 9.0, 3.0)), translation=(1.2, 0.0, 1.5))
    assert TrunkClearance(postures, Scene([wall])).along(places) is None


def test_body_is_on_hands_and_knees_under_less_than_0_6_m() -> None:
    """Knees carry on the flesh of thigh and shank, hands on their heels, which may touch the floor."""
    body = with_further_contacts(human(), ("knees",))
    roof = Obstacle("roof", Box((3.0, 2.0, 0.3)), translation=(0.0, 0.0, 0.75))
    places = {"left_knee": (-0.25, 0.1), "right_knee": (-0.25, -0.1), "left_wrist": (0.5, 0.14),
              "right_wrist": (0.5, -0.14)}  # fmt: skip
    held = {name: point(name, (*place, 0.0), friction=0.7) for name, place in places.items()}
    bent = {"hip_flexion": 1.6, "knee_flexion": 1.7, "shoulder_flexion": 1.5, "ankle_dorsiflexion": -0.8}
    q = body.posture({f"{side}_{name}": angle for side in ("left", "right") for name, angle in bent.items()})
    q[:7] = (-0.25, 0.0, 0.45, 0.0, np.sin(0.7), 0.0, np.cos(0.7))
    scene = Scene([roof])
    posed = PostureFinder(body, scene).pose(held, held, q, q)
    assert posed.q is not None, posed.reason
    assert TrunkPosture.of("on hands and knees", body, posed.q, 1.0).height < 0.6
