"""Bodies, scenes and stances from a few words."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from manikin.body import BodyModel, creature_from_urdf, human, insect
from manikin.contact import Contact, FrictionModel, Stance
from manikin.contact import grasp as contact_grasp
from manikin.contact import point as contact_point
from manikin.contact import sole as contact_sole
from manikin.errors import ContactError, InputError
from manikin.scenarios import load_scenario
from manikin.scene import Obstacle, Scene
from manikin.spatial import FloatArray, frozen_array

SOLE = (0.28, 0.12)
"""Length and width of a sole when none are given, those of a shoe in [Qiu2012]_ 5.4.4 [m]."""

FRICTION = 0.7
"""Coefficient of friction when none is given, that of a rubber sole on a clean floor."""

__all__ = ["creature", "grasp", "human", "point", "scene", "sole", "stance"]


class Unnamed:
    """A contact without its effector, which :func:`stance` names."""

    def __init__(self, kind: Any, position: Sequence[float], options: Mapping[str, Any]) -> None:
        self._kind, self._position, self._options = kind, position, dict(options)

    def named(self, effector: str) -> Contact:
        """The contact of an effector."""
        return self._kind(effector, _point3(self._position, effector), **self._options)


def sole(
    position: Sequence[float],
    yaw: float = 0.0,
    *,
    length: float = SOLE[0],
    width: float = SOLE[1],
    friction: float = FRICTION,
    **options: Any,
) -> Unnamed:
    """Sole on the ground for :func:`stance`.

    Args:
        position: (2,) or (3,) middle of the sole in the world [m]; z is 0 when left out.
        yaw: Direction of the toes, counter-clockwise from x [rad].
        length: [m].
        width: [m].
        friction: Coulomb coefficient.
        options: Further ones of :func:`manikin.contact.sole`.
    """
    given = {"yaw": yaw, "length": length, "width": width, "friction": friction, **options}
    return Unnamed(contact_sole, position, given)


def point(position: Sequence[float], *, friction: float = FRICTION, **options: Any) -> Unnamed:
    """Frictional point contact for :func:`stance`; arguments as of :func:`manikin.contact.point`."""
    return Unnamed(contact_point, position, {"friction": friction, **options})


def grasp(position: Sequence[float], max_force: float, **options: Any) -> Unnamed:
    """Grasp for :func:`stance`; arguments as of :func:`manikin.contact.grasp`."""
    return Unnamed(contact_grasp, position, {"max_force": max_force, **options})


def stance(
    *,
    friction: float = FRICTION,
    normal_force_cap: float | None = 1500.0,
    friction_model: FrictionModel = "outer",
    **contacts: Sequence[float] | Unnamed | Contact,
) -> Stance:
    """Stance from its contacts by effector: ``stance(left_foot=(0, .1), right_hand=grasp((.4, 0, 1), 100))``.

    Args:
        friction: Of contacts that are given as a place alone.
        normal_force_cap: Largest sum of the normal forces [N].
        friction_model: Pyramid that stands for the friction cone: ``outer``, ``inner`` or ``cone``.
        contacts: By effector: a place (2,) or (3,) [m], which is a sole that faces x, or what
            :func:`sole`, :func:`point` or :func:`grasp` made.

    Raises:
        ContactError: If a contact is not usable.
    """
    made = []
    for effector, given in contacts.items():
        if isinstance(given, Contact):
            made.append(given)
            continue
        kind = given if isinstance(given, Unnamed) else sole(given, friction=friction)
        made.append(kind.named(effector))
    return Stance(made, normal_force_cap, friction_model)


def creature(
    source: str | Path = "insect", limbs: Mapping[str, Any] | None = None, **options: Any
) -> BodyModel:
    """Body that is no person: the built-in insect, or a robot or animal from a URDF file.

    Args:
        source: ``"insect"``, or the file.
        limbs: Limbs of the file's body by name, see :func:`manikin.body.creature_from_urdf`.
        options: Of :func:`manikin.body.insect` or :func:`manikin.body.creature_from_urdf`.

    Raises:
        BodyError: If the file or a limb is not usable.
    """
    if str(source) == "insect":
        return insect(**options)
    if limbs is None:
        raise InputError(f"creature {str(source)!r} has no limbs; valid: limbs={{name: {{'tip': link}}}}")
    return creature_from_urdf(source, limbs, **options)


def scene(source: str | Path | Sequence[Obstacle] = (), *, floor: float | None = 0.0) -> Scene:
    """Scene of a scenario, or of obstacles on a floor.

    Args:
        source: Name of a built-in scenario, a scenario file, or obstacles.
        floor: Height of the floor under obstacles [m]; None for none.

    Raises:
        InputError: If the scenario or an obstacle is not usable.
    """
    if isinstance(source, str | Path):
        return load_scenario(str(source)).build_scene()
    return Scene(source, floor)


def _point3(position: Sequence[float], effector: str) -> FloatArray:
    given = tuple(position)
    if len(given) not in (2, 3):
        raise ContactError(f"{effector} is at {given}; valid: [x, y] or [x, y, z] in metres")
    return frozen_array((*given, 0.0)[:3], f"{effector} position [m]", (3,), ContactError)
