"""Motions carried over to other bodies and places: contacts, lengths, times, and the body above them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.analysis.adaptation.conftest import nodding

from manikin.analysis.adaptation import adapt_recording, recorded_on_contacts
from manikin.analysis.adaptation_changes import AdaptationLimits, changes_of, flat_changes
from manikin.analysis.contact_adaptation import effector_placements, scene_under
from manikin.analysis.motion_transfer import (
    FARTHEST,
    NoPlaceError,
    body_like,
    carried_over,
    leg_length,
    with_places,
)
from manikin.body import quadruped
from manikin.errors import InputError
from manikin.numerics.spatial import PlanarTransform
from manikin.scene import Box, Obstacle, Scene

STEP = 0.03


@pytest.fixture(scope="module")
def source():
    """A person who stands and nods, on contacts."""
    return recorded_on_contacts(*nodding())


def replace_placement(item, transform):
    """The same obstacle, where it is in another frame."""
    turn, place = transform.rotations(item.rotation), transform.points(item.translation)
    return Obstacle(item.name, item.shape, turn, place)


def raised(source, foot, height):
    """The scene in which a foot stands higher."""
    hold = next(hold for hold in source.holds if hold.effector == foot)
    return scene_under(
        with_places(source, {hold: hold.contact.position + np.array([0.0, 0.0, height])}), source.floor
    )


def test_the_same_body_in_the_same_place_keeps_the_motion(source):
    assert carried_over(source) is source
    again = carried_over(source, source.body, source.scene)
    np.testing.assert_allclose(again.q, source.q, atol=1e-9)
    np.testing.assert_array_equal(again.schedule.instants, source.schedule.instants)


def test_another_size_makes_the_same_angles_in_similar_time(source):
    """Legs of a length L swing as pendulums do: in times that go with the root of L."""
    tall = body_like(source.body, stature=1.1 * source.body.stature)
    scale = leg_length(tall) / leg_length(source.body)
    assert scale == pytest.approx(1.1)
    carried = carried_over(source, tall)
    np.testing.assert_allclose(carried.q[:, 7:], source.q[:, 7:], atol=1e-9)
    assert np.ptp(carried.time) == pytest.approx(np.sqrt(scale) * np.ptp(source.time))
    apart = [np.subtract(*(hold.contact.position for hold in motion.holds)) for motion in (source, carried)]
    np.testing.assert_allclose(apart[1][:2], scale * apart[0][:2], atol=1e-9)
    stance = carried.schedule.sequence[0].stance
    assert stance["left_foot"].length == pytest.approx(tall.sole_length)
    for name in ("left_foot", "right_foot"):  # on its contact as nearly as the recorded one is
        place = effector_placements(tall, carried.q, name)[0]
        np.testing.assert_allclose(place, np.tile(stance[name].position, (len(place), 1)), atol=2e-3)


def test_a_heavier_person_has_a_larger_cap_and_the_same_size(source):
    heavy = body_like(source.body, mass=1.2 * source.body.mass)
    assert heavy.stature == source.body.stature
    carried = carried_over(source, heavy)
    caps = [motion.schedule.sequence[0].stance.normal_force_cap for motion in (source, carried)]
    assert caps[1] == pytest.approx(1.2 * caps[0])


def test_a_foot_stands_on_a_step_and_the_pelvis_rises_by_half_of_it(source):
    """Both feet count alike; the other one stays where it was."""
    carried = carried_over(source, scene=raised(source, "left_foot", STEP))
    stance, before = carried.schedule.sequence[0].stance, source.schedule.sequence[0].stance
    ways = {name: stance[name].position - before[name].position for name in stance.effectors}
    np.testing.assert_allclose(ways["left_foot"], [0.0, 0.0, STEP], atol=1e-9)
    np.testing.assert_allclose(ways["right_foot"], 0.0, atol=1e-9)
    np.testing.assert_allclose(carried.q[:, 2] - source.q[:, 2], 0.5 * STEP, atol=1e-9)


def test_a_foot_across_an_edge_is_put_on_the_nearer_side(source):
    """A slab begins under the front half of both feet: each stands before it, or on it, as a whole."""
    place = source.holds[0].contact.position
    slab = Obstacle("slab", Box([2.0, 4.0, 0.05]), None, [place[0] + 1.0, 0.0, place[2] + 0.025])
    carried = carried_over(source, scene=Scene([slab], floor_height=source.floor))
    for hold in carried.holds:
        x, height = hold.contact.points_in_world[:, 0], hold.contact.position[2] - source.floor
        on_slab = height == pytest.approx(0.05, abs=1e-6)
        edge = place[0]
        assert x.min() >= edge - 1e-3 if on_slab else x.max() <= edge + 1e-3
        assert np.linalg.norm(hold.contact.position[:2] - place[:2]) < FARTHEST + 0.5


def test_a_foot_without_a_surface_says_so(source):
    place = source.holds[0].contact.position
    pillar = Obstacle("pillar", Box([0.05, 0.05, 0.1]), None, place)
    with pytest.raises(NoPlaceError, match=r"left_foot at .*no level surface carries the whole contact"):
        carried_over(source, scene=Scene([pillar], floor_height=None))


def test_nothing_depends_on_where_the_origin_lies(source):
    """Carried to a place 10 m away and turned by 70 degrees, the motion is the same there."""
    transform, scene = PlanarTransform(10.0, -3.0, 70.0), raised(source, "left_foot", STEP)
    turned = [replace_placement(item, transform) for item in scene.obstacles if isinstance(item.shape, Box)]
    there = carried_over(source, None, Scene(turned, floor_height=source.floor), transform)
    here = carried_over(source, None, scene)
    np.testing.assert_allclose(there.q, transform.poses(here.q), atol=1e-9)


def test_a_body_that_is_no_human_is_refused(source):
    with pytest.raises(InputError, match="valid: a human"):
        carried_over(source, quadruped())


@pytest.fixture(scope="module")
def adapted():
    """A heavier person who nods with one foot on a step, executed."""
    found, supports = nodding()
    source = recorded_on_contacts(found, supports)
    heavy = body_like(source.body, mass=1.2 * source.body.mass)
    return adapt_recording(found, supports, body=heavy, scene=raised(source, "left_foot", STEP), execute=True)


def test_a_heavier_person_on_a_step_is_proved(adapted):
    """Every requirement of the table, with slip below 5 mm and penetration below 2 mm."""
    table = AdaptationLimits().table(adapted)
    assert table.held, table.first_broken.reason
    assert table.value("max_slip_m") <= 0.005
    assert adapted.body.mass == pytest.approx(1.2 * adapted.source.body.mass)


def test_a_limit_that_is_broken_is_named(adapted):
    table = replace(AdaptationLimits(), posture=0.0).table(adapted)
    assert table.broken == {"posture_rms_deg"}
    assert AdaptationLimits().table(replace(adapted, execution=None)) is None


def test_what_has_changed_is_told(adapted):
    changes = changes_of(adapted)
    moved = {contact["effector"]: contact["moved_m"] for contact in changes["contacts"]}
    assert moved == {"left_foot": pytest.approx(STEP), "right_foot": pytest.approx(0.0, abs=1e-9)}
    assert changes["duration_s"]["planned"] == pytest.approx(changes["duration_s"]["recorded"], abs=1e-6)
    assert 0.0 < changes["joints"]["rms_deg"] < 10.0
    assert changes["share_positive_margin"]["executed"] == 1.0
    rows = flat_changes(changes)
    assert rows["contacts"] == "1 of 2 moved, at most 30 mm"
