"""When each stance of a sequence is held."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.contact.sequence import StanceSequence, Swing
from manikin.contact.stance import Stance
from manikin.display import Displayed
from manikin.errors import ContactError
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True, eq=False, repr=False)
class ContactSchedule(Displayed):
    """A stance sequence with its key instants.

    Attributes:
        sequence: The stances, one per phase.
        instants: (phases + 1,) start of each phase and end of the last [s], increasing.
    """

    sequence: StanceSequence
    instants: FloatArray

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {"phases": str(len(self.sequence)), "end": f"{self.instants[-1]:.2f} s"}

    def __init__(self, sequence: StanceSequence, instants: ArrayLike) -> None:
        times = frozen_array(instants, "schedule instants [s]", (len(sequence) + 1,), ContactError)
        if not np.all(np.diff(times) > 0):
            raise ContactError(f"schedule instants are {times.tolist()}; valid: strictly increasing seconds")
        object.__setattr__(self, "sequence", sequence)
        object.__setattr__(self, "instants", times)

    @property
    def durations(self) -> FloatArray:
        """(phases,) duration of each phase [s]."""
        return np.diff(self.instants)

    def phase_at(self, time: ArrayLike) -> NDArray[np.int64]:
        """Index of the phase at each time; the half-open ``[start, end)``, the last one closed.

        Args:
            time: Scalar or (n,) [s]; times outside are given the first or the last phase.
        """
        index = np.searchsorted(self.instants, time, side="right") - 1
        return np.clip(index, 0, len(self.sequence) - 1)

    def stance_at(self, time: float) -> Stance:
        """Return the stance held at ``time`` [s]."""
        return self.sequence[int(self.phase_at(time))].stance

    def support(self, time: ArrayLike, effectors: tuple[str, ...]) -> NDArray[np.bool_]:
        """(n, effectors) whether each effector is in contact at each time."""
        table = np.array([[name in phase.stance for name in effectors] for phase in self.sequence])
        return table[self.phase_at(np.atleast_1d(time))]

    def settling(self, time: ArrayLike, effector: str) -> NDArray[np.bool_]:
        """(n,) whether the contact of an effector may still slide to its place at each time."""
        times = np.atleast_1d(np.asarray(time, dtype=np.float64))
        settling = np.zeros(len(times), dtype=bool)
        held = False
        for phase, start in zip(self.sequence, self.instants, strict=False):
            carries = effector in phase.stance
            if carries and not held and (lasting := phase.stance[effector].settle) > 0.0:
                settling |= (times >= start) & (times < start + lasting)
            held = carries
        return settling

    def swing_interval(self, swing: Swing) -> tuple[float, float]:
        """Lift-off and landing time of a swing [s]."""
        return float(self.instants[swing.first_phase]), float(self.instants[swing.last_phase + 1])
