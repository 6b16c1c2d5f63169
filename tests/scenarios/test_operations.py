"""Operations of a scenario file: what is refused, with what is wrong and where."""

import pytest

from manikin.cli import main
from manikin.errors import ScenarioError
from manikin.scenarios import load_scenario

LIST = "task.operations"


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        (f"{LIST}.1.grasp.object=shelf", r"grasp\.object is 'shelf'; valid: an upright box with mass_kg"),
        (
            f"{LIST}.1.grasp.object=crate",
            r"is 'crate'; valid: the name of an obstacle of the scene \(shelf, b",
        ),
        (f"{LIST}.5.sit.on=sofa", r"operations\[5\]\.sit\.on is 'sofa'"),
        (f"{LIST}.4=null", r"sit comes while the hands hold 'box'; valid: place it before"),
        (f"{LIST}.2=null", r"carry is asked of a body that holds 'box' after grasp"),
        (f"{LIST}.0={{stand: {{}}}}", r"stand is asked of a body that stands"),
        (f"{LIST}.3={{walk_to: {{position: [1, 1]}}, sit: {{on: seat}}}}", "exactly one of walk_to"),
        (f"{LIST}.3={{sit: {{on: seat}}}}", r"sit comes while the hands hold 'box'"),
        (f"{LIST}.0={{jump: {{}}}}", r"jump is not a known key"),
        (f"{LIST}.0={{push: {{on: table, direction: [1, 0, 0], force_N: 50}}}}", "the last one"),
        ("scene.box.rpy_deg.0=20", "an upright box"),
        ("body.load={mass_kg: 3}", "body.load is given beside task.operations"),
        ("wholebody.method=refine", "follow, for operations"),
    ],
)
def test_what_cannot_be_meant_is_refused(override, problem):
    with pytest.raises(ScenarioError, match=problem):
        load_scenario("fetch-box", None, [override])


def test_a_list_may_not_end_with_something_in_the_hands():
    with pytest.raises(ScenarioError, match="end with 'box' in the hands; valid: place it at last"):
        load_scenario("fetch-box", "here", [f"{LIST}.3=null"])


def test_a_wrong_list_ends_with_one_line_and_status_2(capsys):
    status = main(["run", "fetch-box", "--json", "--set", f"{LIST}.1.grasp.object=shelf"])
    said = capsys.readouterr()
    assert status == 2
    assert said.out == ""
    assert len(said.err.strip().splitlines()) == 1
    assert "task.operations[1].grasp.object" in said.err


def test_places_and_headings_move_with_the_scenario():
    moved = load_scenario("fetch-box").moved(1.0, 2.0, 90.0).file.task.operations
    carry = moved[3].carry
    assert carry.position == pytest.approx((1.0 - 1.4, 2.0 + 0.4))
    assert carry.heading_deg == pytest.approx(180.0)
