"""Balance of one stance, to print and to draw."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manikin.balance import BalanceReport, evaluate_balance
from manikin.contact import Stance
from manikin.display import Displayed
from manikin.spatial import FloatArray, frozen_array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Balance(Displayed):
    """How far a stance is from losing its balance, and what gives way first.

    Attributes:
        stance: The contacts.
        com: (3,) [m].
        report: Every criterion.
    """

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
        """What a reader wants to know first."""
        return {
            "balanced": str(self.report.balanced), "margin": f"{self.margin:.1f} N.m",
            "force": f"{self.report.force_margin:.0f} N", "limiting": self.limiting,
        }  # fmt: skip

    def plot(self) -> "Figure":
        """Contacts, support polygon, where the CoM may rest, and the CoM, seen from above."""
        from manikin.figures.style import dress, new_figure

        figure = new_figure(6.0, 6.0, str(self))
        axes = figure.add_subplot()
        for polygon, label in (
            (self.report.support_polygon, "support"), (self.report.com_polygon, "CoM may rest"),
        ):  # fmt: skip
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
    stance: Stance,
    com: Sequence[float],
    mass: float,
    *,
    acceleration: Sequence[float] = (0.0, 0.0, 0.0),
) -> Balance:
    """Judge a stance: how far it is from losing its balance, and what gives way first.

    Args:
        stance: Contacts and caps.
        com: (3,) centre of mass in the world [m].
        mass: [kg].
        acceleration: (3,) of the CoM [m/s^2].

    Raises:
        InputError: If a number is not usable.
    """
    place = frozen_array(com, "com [m]", (3,))
    return Balance(stance, place, evaluate_balance(stance, mass, place, acceleration))
