"""The reachability condition and its stricter variants ([Tonneau2015]_ 6.1, 6.4.2)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from manikin.errors import InputError
from manikin.reachability.surfaces import UsableSurface
from manikin.spatial import finite_number


@dataclass(frozen=True)
class LimbRule:
    """How many and which limbs must reach the scene, for trunks of some tilt.

    Attributes:
        required: Names of limbs that must all reach.
        at_least: Number of limbs that must reach, the required ones included.
        tilt: Smallest and largest angle between the root's z axis and the vertical at which the
            rule holds [rad]: standing limbs for an upright trunk, all limbs for a bent one.
    """

    required: tuple[str, ...] = ()
    at_least: int = 1
    tilt: tuple[float, float] = (0.0, float(np.pi))

    def __post_init__(self) -> None:
        object.__setattr__(self, "required", tuple(self.required))
        if isinstance(self.at_least, bool) or not isinstance(self.at_least, int) or self.at_least < 0:
            raise InputError(f"limb rule at_least is {self.at_least!r}; valid: a whole number >= 0")
        low = finite_number(self.tilt[0], "limb rule tilt[0] [rad]", at_least=0.0)
        high = finite_number(self.tilt[1], "limb rule tilt[1] [rad]", at_least=low, at_most=np.pi)
        object.__setattr__(self, "tilt", (low, high))

    def holds_at(self, tilt: float, slack: float = 0.0) -> bool:
        """Whether the rule is about a trunk of this tilt, give or take ``slack`` [rad]."""
        return self.tilt[0] - slack <= tilt <= self.tilt[1] + slack


@dataclass(frozen=True)
class Condition:
    """What a pose must satisfy beside a free trunk.

    The default is the condition of the thesis: at least one limb reaches some surface.

    Attributes:
        rules: Rules that must all hold.
        surfaces: Which surfaces count for a limb, by its name; any where left out.
    """

    rules: tuple[LimbRule, ...] = (LimbRule(),)
    surfaces: Mapping[str, UsableSurface] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rules", tuple(self.rules))
        object.__setattr__(self, "surfaces", dict(self.surfaces))

    @classmethod
    def limbs(cls, *required: str, at_least: int = 1) -> "Condition":
        """Condition that these limbs reach, and as many in all."""
        return cls((LimbRule(required, max(at_least, len(required))),))

    @classmethod
    def standing_or_bent(
        cls, standing: Sequence[str], bent: Sequence[str], upright: float = np.deg2rad(35.0)
    ) -> "Condition":
        """Condition that some limbs reach when upright and others when bent ([Tonneau2015]_ 6.4.2).

        Args:
            standing: Limbs that must reach when the trunk is tilted by ``upright`` or less.
            bent: Limbs that must reach when it is tilted by ``upright`` or more.
            upright: Border of the two [rad]; our choice.
        """
        rules = (
            LimbRule(tuple(standing), len(standing), (0.0, upright)),
            LimbRule(tuple(bent), len(bent), (upright, float(np.pi))),
        )
        return cls(rules)

    @property
    def key(self) -> str:
        """Text that is equal for equal values."""
        return repr((self.rules, sorted((name, item.key) for name, item in self.surfaces.items())))

    def surface(self, limb: str) -> UsableSurface:
        """Surfaces that count for a limb."""
        return self.surfaces.get(limb, _ANY)

    def check_names(self, limbs: Sequence[str]) -> None:
        """Check every name against those of the limbs there are.

        Raises:
            InputError: If a name is unknown or more limbs are wanted than there are.
        """
        named = [name for rule in self.rules for name in rule.required] + list(self.surfaces)
        unknown = sorted(set(named) - set(limbs))
        if unknown:
            raise InputError(f"condition names limb {unknown[0]!r}; valid: {', '.join(limbs)}")
        most = max((rule.at_least for rule in self.rules), default=0)
        if most > len(limbs):
            raise InputError(f"condition wants {most} limbs; valid: at most {len(limbs)}")


_ANY = UsableSurface()
