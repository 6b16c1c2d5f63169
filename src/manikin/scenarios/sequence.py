"""The stances that a scenario lists, and whether they fit its scene."""

from dataclasses import replace
from itertools import combinations

from manikin.body.anthropometry import TOE_HINGE_FROM_HEEL
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import (
    Contact,
    Phase,
    Stance,
    StanceSequence,
    roll_feet,
    soles_overlap,
)
from manikin.errors import InputError
from manikin.scenarios.contacts import build_contact
from manikin.scenarios.sections import ContactSection, SoleSection
from manikin.scenarios.validation import Path as KeyPath
from manikin.scenarios.values import ScenarioValues
from manikin.scene import Scene


def stance_sequence(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """Build the stances of the explicit supports; feet that roll have heel and toe phases.

    Args:
        values: The scenario's values.
        planning: With the smaller soles, friction and force caps that planning balances on.

    Raises:
        ScenarioError: If there are no supports, or a contact slides between phases.
    """
    sequence, supports = flat_sequence(values, planning=planning), values.explicit_supports()
    if supports.foot == "flat":
        return sequence
    try:
        return roll_feet(sequence, (TOE_HINGE_FROM_HEEL - 0.5) * supports.sole.length_m)
    except InputError as error:
        raise values.refused(("supports", "foot"), error) from None


def flat_sequence(values: ScenarioValues, *, planning: bool = False) -> StanceSequence:
    """Build the stances as the file lists them, with full soles.

    Args:
        values: The scenario's values.
        planning: With the smaller soles, friction and force caps that planning balances on.

    Raises:
        ScenarioError: If there are no supports, or a contact slides between phases.
    """
    supports = values.explicit_supports()
    cap = supports.normal_force_cap_N
    if planning:
        cap = supports.planning_normal_force_cap_N or cap
    model = values.contact_model
    if cap is not None:
        model = replace(model, normal_force_cap=cap)
    try:
        return StanceSequence(
            [
                Phase(
                    Stance([_contact(values, *item, planning) for item in contacts.items()], model=model),
                    section.min_duration_s,
                    section.max_duration_s,
                )
                for section, contacts in zip(supports.phases, supports.resolved_phases(), strict=True)
            ]
        )
    except InputError as error:
        raise values.refused(("supports", "phases"), error) from None


def check_contacts(values: ScenarioValues, scene: Scene, tolerance: float) -> None:
    """Check that every contact of the supports lies on a surface of the scene.

    Args:
        values: The scenario's values.
        scene: The built scene.
        tolerance: Largest gap and overhang of a contact point [m].

    Raises:
        ScenarioError: For the first contact that is off every surface or overlaps another.
    """
    for number, stance in enumerate(phase.stance for phase in flat_sequence(values)):
        for first, second in combinations(stance, 2):
            if soles_overlap(first, second):
                raise values.error(
                    ("supports", "phases", number, second.effector),
                    f"overlaps {first.effector}; valid: soles that lie side by side",
                )
        for contact in stance:
            try:
                scene.touched_obstacle(contact, tolerance)
            except InputError as error:
                path: KeyPath = ("supports", "phases", number, contact.effector)
                raise values.refused(path, error) from None


def _contact(values: ScenarioValues, effector: str, entry: ContactSection, planning: bool) -> Contact:
    supports = values.explicit_supports()
    friction, default_sole = supports.friction, supports.sole
    if planning:
        friction = supports.planning_friction or friction
        default_sole = supports.planning_sole or default_sole
    if effector == "buttocks":
        default_sole = _seat_patch(values.file.body.stature_m)
    return build_contact(
        effector,
        entry,
        friction,
        default_sole,
        planning=planning,
        force_cap=supports.contact_normal_force_cap_N,
    )


def _seat_patch(stature: float) -> SoleSection:
    """Rectangle of the body's buttocks that presses on a seat."""
    return SoleSection(length_m=SEAT_LENGTH * stature, width_m=SEAT_WIDTH * stature)
