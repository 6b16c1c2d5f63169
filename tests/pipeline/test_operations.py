"""Operations: what a person does one after the other, as one motion."""

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.motion.file import read_motions
from manikin.scenarios import load_scenario

GRAVITY = 9.81
HANDS = ("left_hand", "right_hand")


@pytest.fixture(scope="module", params=["planned", pytest.param("executed", marks=pytest.mark.long)])
def moved(request, runs):
    """A box of 5 kg taken from a shelf and put down on it beside, without a step."""
    planned = request.param == "planned"
    return runs("fetch-box", variant="here", overrides=("execution=none",) if planned else ())


def intervals(result):
    return {
        item["operation"]: (item["start_s"], item["end_s"]) for item in result.summary["operations"]["list"]
    }


@pytest.mark.slow
def test_every_operation_is_proved_and_has_its_interval(moved):
    assert moved.verdict == ("planned" if moved.executed is None else "proved"), moved.summary["failure"]
    names = ["grasp box", "lift box", "carry box", "place box"]
    found = intervals(moved)
    assert list(found) == names
    starts, ends = zip(*found.values(), strict=True)
    assert starts[0] == 0.0
    np.testing.assert_allclose(starts[1:], ends[:-1])
    assert ends[-1] == pytest.approx(moved.planned.time[-1])


@pytest.mark.slow
def test_feet_carry_the_box_while_it_is_held(moved):
    """At rest, between two operations, the forces carry the body, or body and box: to 0.1 N of 800 N."""
    motion, body = moved.planned, load_scenario("fetch-box").build_body()
    found = intervals(moved)
    for when, mass in ((0.0, 0.0), (found["carry box"][0], 5.0), (found["place box"][1], 0.0)):
        row = int(np.argmin(np.abs(motion.time - when - 1e-3 * (mass > 0.0))))
        weight = motion.contact_force[row, :, 2].sum()
        assert weight == pytest.approx((body.mass + mass) * GRAVITY, abs=0.1), when


@pytest.mark.slow
def test_palms_stay_on_the_sides_of_the_box(moved):
    """As planned to a millimetre; in the engine, whose joints give way under the load, to 2 cm."""
    motion, room = (moved.planned, 1e-3) if moved.executed is None else (moved.executed, 0.02)
    body, found = load_scenario("fetch-box").build_body(), intervals(moved)
    rows = np.flatnonzero((motion.time >= found["lift box"][0]) & (motion.time <= found["carry box"][1]))
    for row in rows[::100]:
        state = Configuration(body, motion.q[row])
        left, right = (state.effector_placement(hand)[1] for hand in HANDS)
        assert np.linalg.norm(left - right) == pytest.approx(0.32, abs=room)
        assert left[2] == pytest.approx(right[2], abs=room)


@pytest.mark.slow
def test_the_box_rests_where_it_was_to_be_put(moved):
    """Its lower face on the top of the shelf, 1.02 m high; the hands leave it from there."""
    (box,) = moved.summary["operations"]["objects"]
    assert box["position"] == pytest.approx([0.61, 0.05, 1.02 + 0.11], abs=1e-6)


@pytest.mark.slow
def test_the_motion_file_has_the_load_in_its_phases(moved):
    content = read_motions(moved.directory / "motion.h5")
    loads = [0.0 if phase.load is None else phase.load.mass for phase in content.schedule.sequence]
    assert loads == [0.0, 5.0, 5.0, 5.0, 0.0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "operation"),
    [
        pytest.param((), "lift", marks=pytest.mark.long),
        (("scene.1.position=[2.0, 0.0, 1.13]", "scene.0.position=[2.0, 0.0, 1.0]"), "grasp"),
    ],
    ids=["too heavy", "out of reach"],
)
def test_what_nobody_does_fails_with_the_operation_and_the_reason(runs, overrides, operation):
    result = runs("fetch-box", variant="too-heavy", overrides=overrides)
    failure = result.summary["failure"]
    assert failure["reason"].startswith(f"{operation} box: ")
    assert result.executed is None
