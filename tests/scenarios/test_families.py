"""Families of random scenes: plain scenarios that depend on their family and number alone."""

import pytest

from manikin.errors import InputError
from manikin.scenarios import load_scenario
from manikin.scenarios.families import FAMILIES, chosen_families, draw_scene
from manikin.scenarios.families.family import BODY_MASS_INDICES, FARTHEST, STATURES

SEEDS = range(6)


@pytest.mark.parametrize("name", FAMILIES)
def test_scenes_are_plain_and_read_again_from_their_files(name, tmp_path):
    """Start and goal alone; the same scene whatever was drawn before, and from the file that was written."""
    for seed in SEEDS:
        scene = draw_scene(FAMILIES[name], seed, tmp_path)
        given = scene.file.model_dump(mode="json", exclude_defaults=True)
        assert not {"supports", "com_constraints", "planning", "expect", "seed", "walking"} & set(given)
        file = tmp_path / f"{seed}.yaml"
        file.write_text(scene.to_short_yaml())
        assert load_scenario(file).file == scene.file
        assert draw_scene(FAMILIES[name], seed, tmp_path).file == scene.file


@pytest.mark.parametrize("name", FAMILIES)
def test_bodies_and_places_are_in_their_ranges_and_half_of_the_scenes_are_moved(name):
    scenes = [draw_scene(FAMILIES[name], seed) for seed in range(16)]
    moved = 0
    for scene in scenes:
        body, start = scene.file.body, scene.file.task.start
        if body.model == "human":
            assert STATURES[0] <= body.stature_m <= STATURES[1]
            assert (
                BODY_MASS_INDICES[0] - 0.1 <= body.mass_kg / body.stature_m**2 <= BODY_MASS_INDICES[1] + 0.1
            )
        assert max(map(abs, start.at)) <= FARTHEST + 10.0
        numbers = [
            *start.at,
            *scene.file.task.goal.at,
            *(x for item in scene.file.scene for x in item.position),
        ]
        moved += any(round(number, 4) != number for number in numbers)
    assert 2 <= moved <= 14


def test_a_family_that_is_not_known_is_refused():
    assert [family.name for family in chosen_families("stairs, flat")] == ["stairs", "flat"]
    with pytest.raises(InputError, match="'stars'; valid: all, or some of flat"):
        chosen_families("stars")
