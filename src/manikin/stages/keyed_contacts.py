"""What the refinement begins with: contacts in time and a posture at each of their changes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactModel, ContactSchedule
from manikin.contact_planning import ContactPlan
from manikin.scene import Scene
from manikin.spatial import FloatArray
from manikin.wholebody import KeyPostures
from manikin.wholebody.mid_flights import with_mid_flights
from manikin.wholebody.refine_input import KeyPath


@dataclass(frozen=True, eq=False)
class KeyedContacts:
    """What the refinement begins with.

    Attributes:
        schedule: Contacts in time.
        time: (n,) key times [s].
        q: (n, nq) postures at them.
    """

    schedule: ContactSchedule
    time: FloatArray
    q: FloatArray

    @classmethod
    def of_plan(cls, plan: ContactPlan, model: ContactModel) -> "KeyedContacts":
        """A contact plan, every phase as long as it has to be at least.

        Args:
            plan: Found from start and goal.
            model: Contact model of every stance.
        """
        schedule = plan.schedule(model)
        return cls(schedule, *plan.keys(schedule.instants))

    @classmethod
    def of_postures(cls, schedule: ContactSchedule, postures: KeyPostures) -> "KeyedContacts":
        """Postures found at the key instants of a planned centre of mass, with its timing."""
        return cls(schedule, schedule.instants, np.array([item.q for item in postures.postures]))

    def at_pace(self, pace: float) -> "KeyedContacts":
        """The same with everything ``pace`` times as fast."""
        schedule = ContactSchedule(self.schedule.sequence, self.schedule.instants / pace)
        return KeyedContacts(schedule, self.time / pace, self.q)

    def with_lifted_feet(self, body: BodyModel, scene: Scene, padded: Sequence[str]) -> "KeyedContacts":
        """The same with postures between, see :func:`~manikin.wholebody.mid_flights.with_mid_flights`."""
        path = with_mid_flights(body, scene, self.schedule, KeyPath(self.time, self.q), padded)
        return KeyedContacts(self.schedule, path.time, path.q)
