"""A stance: the contacts that hold the body at one time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from manikin.contact.contact import Contact
from manikin.display import Displayed
from manikin.errors import ContactError
from manikin.spatial import finite_number


@dataclass(frozen=True, eq=False, repr=False)
class Stance(Displayed):
    """A set of simultaneous contacts, one per effector.

    Attributes:
        contacts: The contacts, in a stable order.
        normal_force_cap: Largest sum of the normal forces of all soles and points [N];
            closes the wrench polytope ([Qiu2012]_ 4.26, summed along the normals so
            that walls are bounded too). None leaves it to the contacts' own caps.
    """

    contacts: tuple[Contact, ...]
    normal_force_cap: float | None = None

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        cap = "none" if self.normal_force_cap is None else f"{self.normal_force_cap:.0f} N"
        return {"contacts": " ".join(self.effectors), "normal_force_cap": cap}

    def __init__(self, contacts: Sequence[Contact], normal_force_cap: float | None = None) -> None:
        for item in contacts:
            if not isinstance(item, Contact):
                raise ContactError(f"stance contains {item!r}; valid: contacts made by sole, point or grasp")
        names = [contact.effector for contact in contacts]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ContactError(f"stance holds effector {twice[0]!r} twice; valid: one contact per effector")
        if normal_force_cap is not None:
            normal_force_cap = finite_number(
                normal_force_cap, "stance normal_force_cap [N]", above=0.0, error=ContactError
            )
        object.__setattr__(self, "contacts", tuple(contacts))
        object.__setattr__(self, "normal_force_cap", normal_force_cap)

    def __len__(self) -> int:
        return len(self.contacts)

    def __iter__(self) -> Iterator[Contact]:
        return iter(self.contacts)

    def __contains__(self, effector: object) -> bool:
        return any(contact.effector == effector for contact in self.contacts)

    def __getitem__(self, effector: str) -> Contact:
        for contact in self.contacts:
            if contact.effector == effector:
                return contact
        raise KeyError(f"no contact of {effector!r}; this stance has {list(self.effectors)}")

    @property
    def effectors(self) -> tuple[str, ...]:
        """Names of the effectors in contact, in order."""
        return tuple(contact.effector for contact in self.contacts)
