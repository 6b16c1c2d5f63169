"""Statistics of motions that are known, of the published ones and of recorded ones."""

import json
from dataclasses import replace
from importlib import resources
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.body import human
from manikin.errors import InputError
from manikin.numerics.signals import Spread
from manikin.recordings import (
    Origin,
    Overhead,
    PhaseSequence,
    RecordedClip,
    RecordedSupports,
    StatisticsSettings,
    Support,
    SupportPhase,
    SupportPlacement,
    com_extreme,
    first_stance,
    largest_distances,
    passages,
    phase_durations,
    published_consistency,
    published_distances,
    published_heights,
    published_phases,
    published_statistics,
    sequence_consistency,
    shares_within,
    statistics_of,
    support_distances,
    support_placements,
    whole_passage,
)
from manikin.recordings.statistics.clip_statistics import clip_as_dict
from manikin.recordings.statistics.clips import GroupedFile, com_and_tops, grouped_files, read_clips
from manikin.recordings.statistics.phases import by_group, initials, kind_of, mirror_image, mirrored
from manikin.runtime.files import to_json

BOTH, LEFT, RIGHT = ("left_foot", "right_foot"), ("left_foot",), ("right_foot",)


def sequence(*phases, name="made up", group="group"):
    """A motion of phases (duration, effectors)."""
    times = np.cumsum([0.0, *(duration for duration, _ in phases)])
    return PhaseSequence(
        name, group,
        tuple(SupportPhase(a, b, e) for (a, b), (_, e) in zip(pairwise(times), phases, strict=True)),
    )  # fmt: skip


def walker(name="walker", *, steps=4, length=0.6, low=0.3, turn=0.0, shift=(0.0, 0.0), noise=None, first=1.0):
    """Somebody who walks 0.6 s a step and ducks in the middle, by ``low``, with a head 0.7 above.

    The feet are ``first`` * 0.1 m left and right of the way; the left one steps first for 1.0, in a mirror
    the right one for -1.0.
    """
    time = np.linspace(0.0, 0.6 * steps, 60 * steps + 1)
    along = length * steps * time / time[-1]
    sides = ("left_foot", "right_foot") if first > 0.0 else ("right_foot", "left_foot")
    rng = np.random.default_rng(0) if noise else None
    turning = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0, 0, 1.0]])
    move = np.array([*shift, 0.0])

    def there(places):
        return np.asarray(places) @ turning.T + move

    ducked = low * np.exp(-(((along - along[-1] / 2) / 0.3) ** 2))
    com = np.column_stack([along, np.zeros_like(along), 0.95 - ducked])
    supports = []
    for number in range(steps + 2):
        foot, side = sides[number % 2], (0.1, -0.1)[number % 2] * first
        start, end = 0.6 * (number - 1) - 0.1, 0.6 * number + 0.1
        place = np.array([length * max(number - 1, 0), side, 0.0])
        if rng is not None:
            place[:2] += noise * rng.normal(size=2)
        place = there(place)
        kept = (max(start, 0.0), min(end, time[-1]))
        if kept[1] > kept[0]:
            seen = start > 0.0, end < time[-1]
            supports.append(Support(foot, *kept, place, place, place, *seen))
    tops = {"head": there(com + np.array([0.0, 0.0, 0.7])), "trunk": there(com + np.array([0.0, 0.0, 0.45]))}
    known = RecordedSupports(tuple(supports), 0.0, float(time[-1]), (0.0,))
    return RecordedClip(name, "walkers", known, time, there(com), tops, 0.95)


# --- the published motions


@pytest.fixture(scope="module")
def quoted():
    """Left foot first, in C1 and C2, by configuration: what the thesis' figure and means are of."""
    groups = by_group(published_phases("left_foot"))
    return {group: members for group, members in groups.items() if not group.endswith("C3")}


def test_published_means_are_those_quoted(quoted):
    """The text gives two digits, "about": SS-1 0.5 s, DS-2 0.1 s in all, DS-3 and SS-3 by configuration.

    All agree within 0.02 s, of which 0.005 s is rounding.
    """
    assert [len(members) for members in quoted.values()] == [5, 6, 6, 6]
    everybody = phase_durations([one for members in quoted.values() for one in members])
    assert everybody["SS-1"].mean == pytest.approx(0.5, abs=0.02)
    assert everybody["DS-2"].mean == pytest.approx(0.1, abs=0.02)
    low = phase_durations([*quoted["H1C1"], *quoted["H2C1"]])
    assert low["DS-3"].mean == pytest.approx(0.23, abs=0.02)
    assert phase_durations(quoted["H3C1"])["DS-3"].mean == pytest.approx(0.58, abs=0.005)
    assert phase_durations(quoted["H2C2"])["DS-3"].mean == pytest.approx(0.55, abs=0.005)
    assert phase_durations(quoted["H2C2"])["SS-3"].mean == pytest.approx(0.98, abs=0.005)
    beams = [one for group, members in quoted.items() if group.endswith("C1") for one in members]
    assert phase_durations(beams)["SS-3"].mean == pytest.approx(0.52, abs=0.005)


def test_right_foot_first_would_change_the_means(quoted):
    """DS-3 in H1C1 and H2C1 is 0.238 s with the 11 motions that begin with the left foot."""
    low = [one for group in ("H1C1", "H2C1") for one in quoted[group]]
    other = next(one for one in published_phases() if one.name == "01_TR_H1C1L_1")
    assert other.first_step == "right_foot"
    assert len(other.phases) == 8
    assert phase_durations(low)["DS-3"].mean == pytest.approx(0.2382, abs=1e-4)
    assert phase_durations([*low, other])["DS-3"].mean == pytest.approx(0.2283, abs=1e-4)


def test_bars_of_the_published_figure_are_whole_phases(quoted):
    """Five phases are averaged: what came before the first step is as long as the recording made it."""
    for members in quoted.values():
        assert list(phase_durations(members)) == ["SS-1", "DS-2", "SS-2", "DS-3", "SS-3"]
    first = [one.phases[0].duration for one in quoted["H1C1"]]
    assert np.mean(first) == pytest.approx(1.534)
    assert (min(first), max(first)) == pytest.approx((1.10, 1.75))


def test_key_frames_of_the_example_are_those_listed():
    """Of 01_TR_H1C1S2_1 the text lists the frames; its hand grasps in SS-2, as all others' do."""
    example = next(one for one in published_phases() if one.name == "01_TR_H1C1S2_1")
    frames = [round(100 * phase.start) for phase in example.phases] + [round(100 * example.phases[-1].end)]
    assert frames == [1, 158, 209, 222, 285, 296, 346, 372]
    file = resources.files("manikin.recordings") / "data" / "qiu_2012_chapter_3.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    grasps = {name: grasp[0] * data["frame_s"] for name, _, *grasp in data["table_3_4"] if grasp}
    assert grasps["01_TR_H1C1S2_1"] == pytest.approx(2.40)
    assert len(grasps) == 10
    for one in published_phases():
        if one.name in grasps:
            phase = one.phases[one.labels.index("SS-2")]
            assert phase.start < grasps[one.name] < phase.end


def test_published_sequences_agree_with_each_other():
    """Table 3.2 is of three people; of the one in Table 3.4 seven of eight began with the left foot."""
    known = published_consistency()
    assert (known.motions, known.counts[known.modal]) == (24, 23)
    assert initials(known.modal) == "LR R LR L LR R LR"
    assert known.modal_share == pytest.approx(23 / 24)
    free = [one for one in published_phases() if "C3" not in one.name and "L_" in one.name]
    own = sequence_consistency(free, phases=6)
    assert own.first_steps == {"left_foot": 7, "right_foot": 1}
    assert own.modal == known.modal[:6]
    # The first six phases of the other motion are the mirror image.
    assert (own.modal_share, own.mirrored_share) == (7 / 8, 1.0)


def test_published_distances_and_heights():
    left, right = published_distances().values()
    assert (left.mean, left.deviation, left.smallest, left.largest) == (1.0101, 0.0117, 0.9950, 1.0331)
    assert (right.mean, right.deviation, right.smallest, right.largest) == (1.0205, 0.0261, 0.9962, 1.1012)
    heights = published_heights()
    assert heights.standing - heights.lowest["H1"] == pytest.approx(0.12)
    assert heights.beams["H3"] - heights.lowest["H3"] == pytest.approx(0.45)


def test_published_motions_have_the_statistics_of_recorded_ones():
    found = published_statistics()
    assert list(found) == ["H1C1", "H2C1", "H3C1", "H2C2", "H2C3", "all"]
    assert found["H1C1"].consistency.modal_share == 1.0
    told = json.loads(to_json(found["all"].as_dict()))
    assert told["largest_com_distance"]["left_foot"]["mean_m"] == 1.0101
    assert told["sequences"][0] == {"sequence": "LR R LR L LR R LR", "motions": 23}


# --- spread and phases


@given(st.lists(st.floats(0.1, 10.0), min_size=2, max_size=20), st.floats(0.1, 10.0))
def test_variation_does_not_depend_on_the_unit(values, scale):
    one, other = Spread.of(values), Spread.of(scale * value for value in values)
    assert one.deviation == pytest.approx(np.std(values, ddof=1), abs=1e-12)
    assert other.variation == pytest.approx(one.variation, rel=1e-9, abs=1e-9)
    assert one.smallest <= one.mean + 1e-9
    assert one.mean <= one.largest + 1e-9


def test_one_value_has_no_deviation():
    one = Spread.of([2.0])
    assert one.count == 1
    assert np.isnan(one.deviation)
    assert json.loads(to_json(one.as_dict("s")))["deviation_s"] is None
    with pytest.raises(InputError, match="valid: at least one"):
        Spread.of([])


def test_kinds_count_feet_and_name_others():
    assert [kind_of(one) for one in ((), LEFT, BOTH)] == ["flight", "SS", "DS"]
    assert kind_of(("left_hand", "right_foot")) == "SS+left_hand"
    assert kind_of(("buttocks", "left_foot", "right_foot")) == "DS+buttocks"
    assert kind_of(("left_hand",)) == "left_hand"
    assert mirrored("left_hand") == "right_hand"
    assert mirrored("buttocks") == "buttocks"


def test_hands_can_be_left_out():
    """A grasp within a phase divides it only where hands count."""
    one = sequence((0.5, BOTH), (0.2, RIGHT), (0.3, (*RIGHT, "left_hand")), (0.5, BOTH))
    assert one.labels == ("DS-1", "SS-1", "SS+left_hand-1", "DS-2")
    feet = one.of_effectors(BOTH)
    assert feet.labels == ("DS-1", "SS-1", "DS-2")
    assert feet.phases[1].duration == pytest.approx(0.5)
    assert one.whole == (False, True, True, False)
    assert list(phase_durations([feet])) == ["SS-1"]
    assert list(phase_durations([one], "effectors")) == ["right_foot", "right_foot+left_hand"]
    with pytest.raises(InputError, match="valid: number, kind, effectors"):
        phase_durations([one], "sort")


@given(st.lists(st.tuples(st.floats(0.001, 0.5), st.sampled_from([(), LEFT, RIGHT, BOTH])), min_size=1))
def test_short_phases_leave_no_gap(phases):
    one = sequence(*phases)
    shown = one.without_short(0.03)
    assert shown.phases[0].start == one.phases[0].start
    assert shown.phases[-1].end == one.phases[-1].end
    assert all(a.end == b.start and a.effectors != b.effectors for a, b in pairwise(shown.phases))
    assert all(phase.duration >= 0.03 for phase in shown.phases[1:])


def test_first_step_is_the_first_touch_down():
    assert sequence((1.0, BOTH), (0.5, RIGHT), (0.1, BOTH)).first_step == "left_foot"
    assert sequence((1.0, RIGHT), (0.1, ()), (0.1, LEFT)).first_step == "left_foot"
    assert sequence((1.0, BOTH), (0.5, RIGHT)).first_step is None


def test_mirror_images_are_counted_as_one():
    left = sequence((1.0, BOTH), (0.5, RIGHT), (0.1, BOTH))
    right = sequence((1.0, BOTH), (0.5, LEFT), (0.1, BOTH))
    other = sequence((1.0, BOTH), (0.5, ()), (0.1, BOTH))
    found = sequence_consistency([left, right, left, other])
    assert (found.motions, found.modal_share, found.mirrored_share) == (4, 0.5, 0.75)
    assert found.first_steps == {"left_foot": 3, "right_foot": 1}  # of two at once the left one is named
    assert mirror_image(found.modal) == tuple(frozenset(one) for one in (BOTH, LEFT, BOTH))
    assert sequence_consistency([]).modal_share == 0.0


def test_recordings_that_begin_anywhere_are_compared_from_a_phase():
    """The first of them begins within a double support, which is not seen from its beginning."""
    cycle = [(0.2, BOTH), (0.5, RIGHT), (0.2, BOTH), (0.5, LEFT)]
    walks = [sequence(*cycle * 3), sequence(*cycle[1:], *cycle * 3), sequence(*cycle[3:], *cycle * 3)]
    assert sequence_consistency(walks, phases=4).mirrored_share == pytest.approx(2 / 3)
    found = sequence_consistency(walks, phases=4, start="DS")
    assert (found.modal_share, found.mirrored_share) == (pytest.approx(2 / 3), 1.0)
    assert initials(found.modal) == "LR L LR R"
    assert sequence_consistency(walks, start="flight").modal == ()


# --- placements


@given(st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.booleans())
def test_placements_do_not_depend_on_the_world(turn, x, y, from_lowest):
    origin = com_extreme if from_lowest else first_stance
    here, there = walker(), walker(turn=turn, shift=(x, y))
    one = support_placements([here], [origin(here)])
    other = support_placements([there], [origin(there)])
    assert [(p.effector, p.number) for p in one] == [(p.effector, p.number) for p in other]
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a.places, b.places, atol=1e-9)


def test_mirrored_motions_have_the_same_placements():
    one, image = walker("one"), walker("image", first=-1.0)
    for placement in support_placements([one, image], mirror=True):
        assert placement.clips == ("one", "image")
        np.testing.assert_allclose(placement.places[0], placement.places[1], atol=1e-12)
    apart = support_placements([one, image])
    assert (
        max(np.ptp(placement.places, axis=0).max() for placement in apart if len(placement.places) > 1) > 0.1
    )


def test_supports_are_numbered_from_the_origin():
    clip = walker()
    stance = {(p.effector, p.number): p.mean for p in support_placements([clip])}
    np.testing.assert_allclose(stance["left_foot", 0] + stance["right_foot", 0], 0.0, atol=1e-12)
    assert stance["left_foot", 1][0] == pytest.approx(0.6)
    bar = com_extreme(clip)
    assert bar.instant == pytest.approx(1.2)
    np.testing.assert_allclose(bar.place, [1.2, 0.0], atol=1e-9)
    for placement in support_placements([clip], [bar]):
        assert (placement.number > 0) == (placement.mean[0] > -0.01) or placement.number == 0


def test_half_of_normal_places_are_in_their_ellipse():
    rng = np.random.default_rng(1)
    mixing = np.array([[0.3, 0.1], [0.0, 0.1]])
    places = rng.normal(size=(4000, 2)) @ mixing.T + [1.0, -0.2]
    found = SupportPlacement("left_foot", 1, tuple(map(str, range(4000))), places)
    halves, turn = found.ellipse(0.5)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    inside = np.linalg.norm((places - found.mean) @ axes.T / halves, axis=1) < 1.0
    assert np.mean(inside) == pytest.approx(0.5, abs=0.03)  # four deviations of 4000 draws
    with pytest.raises(InputError, match="valid: a share in 0 to 1"):
        found.ellipse(1.0)
    assert np.isnan(replace_places(found, places[:1]).covariance).all()


def replace_places(placement, places):
    return replace(placement, clips=tuple(map(str, range(len(places)))), places=places)


def test_without_motion_there_is_no_direction():
    clip = walker()
    still = replace(clip, com=np.tile(clip.com[0], (len(clip.time), 1)))
    with pytest.raises(InputError, match="without a direction"):
        first_stance(still)
    (found,) = statistics_of([still]).values()
    assert list(found.unplaced) == ["walker"]
    with pytest.raises(InputError, match="valid: one for each"):
        support_placements([clip], [Origin(np.zeros(2), 0.0, 0.0)] * 2)


# --- distances and heights


def test_distances_are_those_of_geometry():
    clip = walker(low=0.0)
    for one, support in zip(support_distances(clip), clip.supports.supports, strict=True):
        along = clip.com[0, 0] + one.time - support.place[0]  # 1 m/s
        np.testing.assert_allclose(one.distance, np.sqrt(along**2 + 0.1**2 + 0.95**2), atol=1e-9)
        assert (one.time[0], one.time[-1]) == pytest.approx((support.start, support.end), abs=0.011)
    largest = largest_distances([clip, walker(low=0.0, length=0.3)])
    assert [spread.count for spread in largest.values()] == [2, 2]
    assert largest["left_foot"].smallest < largest["left_foot"].largest
    shares = [shares_within([clip], limit)["left_foot"] for limit in (0.9, 1.0, 2.0)]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)


@given(st.floats(0.2, 0.6), st.floats(0.0, 0.15))
def test_room_below_a_bar_is_what_the_head_leaves(low, higher):
    clip = walker(low=low)
    head = 0.95 - low + 0.7
    (found,) = passages(clip, Overhead(head + 0.05 + higher * low))
    assert found.com_lowest == pytest.approx(0.95 - low, abs=1e-6)
    assert found.room == pytest.approx(0.05 + higher * low, abs=1e-6)
    assert found.below == pytest.approx(found.room + 0.7)
    assert found.tops["trunk"] == pytest.approx(head - 0.25, abs=1e-6)
    assert found.start < found.com_lowest_at < found.end
    assert passages(clip, Overhead(head - 0.01)) == ()


def test_room_below_a_box_is_the_least_one_below_it():
    clip = walker(low=0.3)
    over = Overhead(1.5, (1.0, 1.4), (-1.0, 1.0))
    (found,) = passages(clip, over)
    # The head is highest at the edges, 0.2 m from the lowest point.
    head = 1.65 - 0.3 * np.exp(-((0.2 / 0.3) ** 2))
    assert found.room == pytest.approx(1.5 - head, abs=1e-3)
    assert found.start == pytest.approx(1.0, abs=0.011)
    (hit,) = passages(clip, replace(over, height=1.4))
    assert hit.room < 0.0
    assert passages(clip, Overhead(1.5, (1.0, 1.4), (5.0, 6.0))) == ()


def test_who_crouches_on_the_spot_passes_no_bar():
    clip = walker(length=0.02)
    assert passages(clip, Overhead(1.45)) == ()
    assert whole_passage(clip).com_lowest == pytest.approx(0.65)


def test_who_is_low_at_the_beginning_passes_no_bar():
    """Somebody seated who rises is below a bar, and has not come from before it."""
    clip, later = walker(), 120
    rises = replace(
        clip,
        time=clip.time[later:],
        com=clip.com[later:],
        tops={name: top[later:] for name, top in clip.tops.items()},
    )
    assert len(passages(clip, Overhead(1.5))) == 1
    assert passages(rises, Overhead(1.5)) == ()


def test_heights_are_those_above_the_floor():
    clip = walker()
    up = np.array([0.0, 0.0, 2.0])
    raised = replace(
        clip,
        supports=replace(clip.supports, surfaces=(2.0,)),
        com=clip.com + up,
        tops={name: top + up for name, top in clip.tops.items()},
    )
    (one,), (other,) = (passages(each, Overhead(1.5)) for each in (clip, raised))
    assert other.room == pytest.approx(one.room)
    assert other.com_lowest == pytest.approx(one.com_lowest)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Overhead(-1.0), "height to pass under"),
        (lambda: Overhead(1.0, (0.0, 1.0)), "both for a box"),
        (lambda: Overhead(1.0, (1.0, 0.0), (0.0, 1.0)), "valid: rising"),
        (lambda: StatisticsSettings(origin="here"), "valid: stance, lowest, highest"),
        (lambda: passages(replace(walker(), tops={}), Overhead(1.0)), "no highest points"),
        (lambda: replace(walker(), time=np.zeros(241)), "do not rise"),
        (lambda: grouped_files(["nowhere/*.bvh"]), "no recording there"),
    ],
)
def test_misuse_is_refused_in_one_line(make, told):
    with pytest.raises(InputError, match=told) as refused:
        make()
    assert "\n" not in str(refused.value)


@settings(max_examples=10)
@given(st.integers(0, 2**16))
def test_tops_are_the_highest_points_of_the_shapes(seed):
    """Against Coal's boxes around the shapes, which touch the highest points of capsules and spheres."""
    body = human(1.75, 75.0)
    rng = np.random.default_rng(seed)
    q = body.standing_posture()
    turn = pin.Quaternion(pin.exp3(rng.normal(size=3)))
    q[3:7] = turn.coeffs()
    q[7:] = rng.uniform(body.lower, body.upper)
    com, tops = com_and_tops(body, q[None], {segment.name: (segment.name,) for segment in body.segments})
    data, geometry = body.pinocchio.createData(), body.geometry.createData()
    pin.updateGeometryPlacements(body.pinocchio, data, body.geometry, geometry, q)
    for name, top in tops.items():
        highest = -np.inf
        for shape, place in zip(body.geometry.geometryObjects, geometry.oMg, strict=True):
            if shape.name.startswith(f"{name}/"):
                shape.geometry.computeLocalAABB()
                local = np.array([shape.geometry.aabb_local.min_, shape.geometry.aabb_local.max_])
                centre, half = local.mean(axis=0), np.ptp(local, axis=0) / 2
                if type(shape.geometry).__name__ == "Capsule":
                    radius = shape.geometry.radius
                    reach = radius + abs(place.rotation[2, 2]) * shape.geometry.halfLength
                elif type(shape.geometry).__name__ == "Sphere":
                    reach = shape.geometry.radius
                else:
                    reach = np.abs(place.rotation[2]) @ half
                highest = max(highest, place.act(centre)[2] + reach)
        assert top[0, 2] == pytest.approx(highest, abs=1e-9)
    np.testing.assert_allclose(com[0], pin.centerOfMass(body.pinocchio, data, q), atol=1e-12)


def test_everything_of_one_motion_is_told_in_json():
    how = StatisticsSettings(Overhead(1.5), active=BOTH, origin="lowest")
    clip = walker(noise=0.01)
    told = json.loads(to_json(clip_as_dict(clip, how)))
    assert {one["effectors"][0] for one in told["phases"]} <= set(BOTH)
    assert len(told["passages"]) == 1
    assert told["whole"]["tops_m"].keys() == {"head", "trunk"}
    (group,) = statistics_of([clip], how).values()
    told = json.loads(to_json(group.as_dict()))
    assert told["placements"][0]["covariance_m2"] == [[None, None], [None, None]]
    assert told["com_lowest"]["count"] == 1


# --- recorded motions


@pytest.fixture(scope="module")
def recorded(recordings_folder, tmp_path_factory):
    """One who ducks, one who jumps, one who goes under bars twice, and a file that is none."""
    folder = recordings_folder / "cmu_asf_amc"
    names = {"127_29": "duck", "127_25": "jump", "01_13_f140-760": "bars"}
    files = [GroupedFile(folder / f"{name}.amc", group) for name, group in names.items()]
    if not all(file.path.exists() for file in files):
        pytest.skip("the clips of people who duck are not there")
    broken = tmp_path_factory.mktemp("clips") / "broken.bvh"
    broken.write_text("no motion")
    return read_clips([GroupedFile(broken, "duck"), *files])


def test_a_bad_file_takes_no_other_with_it(recorded):
    ((path, reason),) = recorded.refused.items()
    assert path.name == "broken.bvh"
    assert "broken.bvh" in reason
    assert "\n" not in reason
    assert [clip.group for clip in recorded.clips] == ["duck", "jump", "bars"]
    # One skeleton, one person: the same lengths.
    assert recorded.clips[0].standing_com == recorded.clips[1].standing_com


def test_who_ducks_is_lower_than_who_jumps(recorded):
    """The description of the files: heads of 0.6 to 0.8 m in ducking, jumps over 0.8 m."""
    duck, jump, bars = (whole_passage(clip) for clip in recorded.clips)
    assert duck.tops["head"] < 1.0 < jump.tops["head"]
    assert duck.com_lowest < 0.65
    assert jump.com_highest > recorded.clips[1].standing_com + 0.3
    assert bars.com_lowest < 0.65


def test_two_passages_are_found_where_there_are_two(recorded):
    """The clip is described as ducking under a bar twice; the head's joint is at 1.03 m there."""
    found = passages(recorded.clips[2], Overhead(1.3))
    assert len(found) == 2
    assert all(0.1 < one.room < 0.35 for one in found)
    # The same bar both ways: where the lowest points are agrees within a step.
    assert abs(found[0].com_place[0] - found[1].com_place[0]) < 0.4


def test_a_jump_has_one_long_flight(recorded):
    jump = recorded.clips[1].phases
    flights = [
        phase.duration for phase, kind in zip(jump.phases, jump.kinds, strict=True) if kind == "flight"
    ]
    assert max(flights) > 0.4
    assert sorted(flights)[-2] < 0.2


def test_words_are_files_folders_or_patterns(bvh_file):
    folder = bvh_file.parent
    for word, group in (
        (str(bvh_file), folder.name),
        (str(folder), folder.name),
        (f"duck={folder}/*.bvh", "duck"),
    ):
        (found,) = grouped_files([word])
        assert (found.path, found.group) == (bvh_file, group)
