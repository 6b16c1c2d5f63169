"""A force that an effector in contact should feel, such as the reaction of what it pushes."""

from dataclasses import dataclass

from manikin.errors import InputError
from manikin.spatial import FloatArray, finite_number, frozen_array


@dataclass(frozen=True, eq=False)
class ForceWish:
    """Force of the scene on one effector that rises from nothing and is held.

    Attributes:
        effector: Name of an effector of the schedule.
        force: (3,) when it is held [N].
        start: When it begins to rise [s].
        ramp: How long it rises [s].
        weight: Of its squared error beside the tasks of the controller [1/N^2]; our choice.
    """

    effector: str
    force: FloatArray
    start: float
    ramp: float
    weight: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", frozen_array(self.force, "wished force [N]", (3,), InputError))
        for name in ("ramp", "weight"):
            finite_number(getattr(self, name), f"force wish {name}", above=0.0, error=InputError)

    def at(self, time: float) -> FloatArray:
        """(3,) force at a time [N]; it rises without a jump of its rate."""
        share = min(max((time - self.start) / self.ramp, 0.0), 1.0)
        return share * share * (3.0 - 2.0 * share) * self.force
