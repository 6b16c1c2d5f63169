"""Bodies, scenes, stances and their balance from a few words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from manikin.balance import BalanceReport, evaluate_balance
from manikin.body import BodyModel, creature_from_mjcf, creature_from_urdf, insect, quadruped
from manikin.body.human import human
from manikin.contact import Contact, FrictionModel, Stance
from manikin.contact import grasp as contact_grasp
from manikin.contact import point as contact_point
from manikin.contact import sole as contact_sole
from manikin.errors import ContactError, InputError
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.runtime.display import Displayed
from manikin.scenarios import load_scenario
from manikin.scene import Obstacle, Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


__all__ = ["Balance", "balance", "creature", "grasp", "human", "point", "scene", "sole", "stance"]


@dataclass(frozen=True, eq=False, repr=False)
class Balance(Displayed):
    """Balance of a stance with a CoM (3,) [m]: margins, what gives way first, a report of all criteria."""

    stance: Stance
    com: FloatArray
    report: BalanceReport

    @property
    def margin(self) -> float:
        """Wrench margin about the centre of mass [N.m]."""
        return self.report.margin

    @property
    def limiting(self) -> str:
        """What gives way first, in words."""
        return self.report.limiting.description

    def facts(self) -> dict[str, str]:
        """Labels and texts of the value."""
        return {
            "balanced": str(self.report.balanced), "margin": f"{self.margin:.1f} N.m",
            "force": f"{self.report.force_margin:.0f} N", "limiting": self.limiting,
        }  # fmt: skip

    def plot(self) -> "Figure":
        """Contacts, support polygon, where the CoM may rest, and the CoM, seen from above."""
        from manikin.reports.figures.style import dress, new_figure

        figure = new_figure(6.0, 6.0, str(self))
        axes = figure.add_subplot()
        areas = {"support": self.report.support_polygon, "CoM may rest": self.report.com_polygon}
        for label, polygon in areas.items():
            if len(polygon) > 2:
                axes.fill(*np.asarray(polygon).T, alpha=0.2, label=label)
        for contact in self.stance:
            axes.plot(*contact.points_in_world[:, :2].T, "s", markersize=4, label=contact.effector)
        axes.plot(*self.com[:2], "k+", markersize=12, label="CoM")
        axes.set_aspect("equal")
        axes.legend(loc="upper right", fontsize=8)
        dress(axes, "y [m]", "x [m]")
        return figure


def balance(
    stance: Stance, com: Sequence[float], mass: float, *, acceleration: Sequence[float] = (0.0, 0.0, 0.0)
) -> Balance:
    """Judge a stance: how far it is from losing its balance, and what gives way first.

    Args:
        com: (3,) centre of mass in the world [m]; InputError if this or another number is not usable.
        mass: [kg].
        acceleration: (3,) of the CoM [m/s^2].
    """
    place = frozen_array(com, "com [m]", (3,))
    return Balance(stance, place, evaluate_balance(stance, mass, place, acceleration))


SOLE = (0.28, 0.12)
"""Length and width of a sole when none are given, those of a shoe in [Qiu2012]_ 5.4.4 [m]."""
FRICTION = 0.7
"""Coefficient of friction when none is given, that of a rubber sole on a clean floor."""


class Unnamed:
    """A contact without its effector, which :func:`stance` names."""

    def __init__(self, kind: Any, position: Sequence[float], options: Mapping[str, Any]) -> None:
        self._kind, self._position, self._options = kind, position, dict(options)

    def named(self, effector: str) -> Contact:
        """The contact of an effector."""
        place = tuple(self._position)
        if len(place) not in (2, 3):
            raise ContactError(f"{effector} is at {place}; valid: [x, y] or [x, y, z] in metres")
        at = frozen_array((*place, 0.0)[:3], f"{effector} position [m]", (3,), ContactError)
        return self._kind(effector, at, **self._options)


def sole(
    position: Sequence[float], yaw: float = 0.0, *, length: float = SOLE[0], width: float = SOLE[1],
    friction: float = FRICTION, **options: Any,
) -> Unnamed:  # fmt: skip
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
    *, friction: float = FRICTION, normal_force_cap: float | None = 1500.0,
    friction_model: FrictionModel = "outer", **contacts: Sequence[float] | Unnamed | Contact,
) -> Stance:  # fmt: skip
    """Stance from its contacts by effector: ``stance(left_foot=(0, .1), right_hand=grasp((.4, 0, 1), 100))``.

    Args:
        friction: Of contacts that are given as a place alone.
        normal_force_cap: Largest sum of the normal forces [N].
        friction_model: Pyramid that stands for the friction cone: ``outer``, ``inner`` or ``cone``.
        contacts: By effector: a place (2,) or (3,) [m], which is a sole that faces x, or what :func:`sole`,
            :func:`point` or :func:`grasp` made; ContactError if it is not usable.
    """
    made = []
    for effector, given in contacts.items():
        if not isinstance(given, Contact):
            kind = given if isinstance(given, Unnamed) else sole(given, friction=friction)
            given = kind.named(effector)
        made.append(given)
    return Stance(made, normal_force_cap, friction_model)


def creature(
    source: str | Path = "insect", limbs: Mapping[str, Any] | None = None, **options: Any
) -> BodyModel:
    """Body that is no person: the built-in insect or quadruped, or a robot or animal from a file.

    Args:
        source: ``"insect"``, ``"quadruped"``, or a file, of MJCF if its name ends in ``.xml`` or ``.mjcf``,
            else of URDF; BodyError if it or a limb is not usable.
        limbs: Limbs of the file's body by name, see :func:`manikin.body.creature_from_urdf`.
        options: Of that function, :func:`manikin.body.creature_from_mjcf`, :func:`manikin.body.insect` or
            :func:`manikin.body.quadruped`.
    """
    built_in = {"insect": insect, "quadruped": quadruped}
    if str(source) in built_in:
        return built_in[str(source)](**options)
    if limbs is None:
        raise InputError(f"creature {str(source)!r} has no limbs; valid: limbs={{name: {{'tip': link}}}}")
    read = creature_from_mjcf if Path(source).suffix.lower() in (".xml", ".mjcf") else creature_from_urdf
    return read(source, limbs, **options)


def scene(source: str | Path | Sequence[Obstacle] = (), *, floor: float | None = 0.0) -> Scene:
    """Scene of a scenario, or of obstacles on a floor.

    Args:
        source: Name of a built-in scenario, a scenario file, or obstacles; InputError if not usable.
        floor: Height of the floor under obstacles [m]; None for none.
    """
    if isinstance(source, str | Path):
        return load_scenario(str(source)).build_scene()
    return Scene(source, floor)
