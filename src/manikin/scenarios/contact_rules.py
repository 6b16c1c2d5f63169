"""What the contacts of a scenario can carry, and on which part of a sole it may stand."""

from manikin.body import BodyModel
from manikin.contact_planning import ContactRules
from manikin.scenarios.values import ScenarioValues

PATCH_WIDTH = 0.7
"""Width of the front of a sole that has to lie on a hold, relative to the sole's."""

HINGE_ROOM = 0.005
"""Distance of that part to the hinge of the toes, which would give way [m]."""


def contact_rules(values: ScenarioValues, body: BodyModel) -> ContactRules:
    """Rules of the file's ``contacts`` for a body.

    Args:
        values: The scenario's values.
        body: Its body; one without soles has no front of them.
    """
    options, patch = values.contacts, None
    if options.forefoot_m is not None and body.sole_length and body.sole_width:
        end = _toe_hinge(body) - HINGE_ROOM
        patch = (end - options.forefoot_m, end, PATCH_WIDTH * body.sole_width)
    return ContactRules(friction_of(values), options.grasp_force_N, 0.0, patch)


def friction_of(values: ScenarioValues) -> float:
    """Coulomb coefficient of the file's supports, or of its contacts where those are found."""
    supports = values.file.supports
    return values.contacts.friction if supports is None else supports.friction


def _toe_hinge(body: BodyModel) -> float:
    """Where the hinge of the toes crosses the sole's x axis; its tip without such a hinge [m]."""
    foot = body.effector("left_foot")
    toes = [segment for segment in body.segments if segment.parent == foot.segment and segment.hinges]
    own = foot.rotation.T @ (toes[0].origin - foot.translation) if toes else None
    return 0.5 * (body.sole_length or 0.0) if own is None else float(own[0])
