"""A stance: the contacts that hold the body at one time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from manikin.contact.contact import Contact, ContactKind
from manikin.contact.model import ContactModel, FrictionModel, default_normal_force_cap
from manikin.display import Displayed
from manikin.errors import ContactError


@dataclass(frozen=True, eq=False, repr=False)
class Stance(Displayed):
    """A set of simultaneous contacts, one per effector.

    Attributes:
        contacts: The contacts, in a stable order.
        model: Friction cone and shared normal-force cap, which every stage and measurement obeys.
    """

    contacts: tuple[Contact, ...]
    model: ContactModel

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        cap = "none" if self.normal_force_cap is None else f"{self.normal_force_cap:.0f} N"
        return {
            "contacts": " ".join(self.effectors), "friction_model": self.friction_model,
            "normal_force_cap": cap,
        }  # fmt: skip

    def __init__(
        self,
        contacts: Sequence[Contact],
        normal_force_cap: float | None = None,
        friction_model: FrictionModel = "outer",
        *,
        model: ContactModel | None = None,
    ) -> None:
        """Make a stance.

        Args:
            contacts: One per effector.
            normal_force_cap: Of the contact model [N].
            friction_model: Of the contact model.
            model: The contact model as a whole; replaces the two.

        Raises:
            ContactError: If an effector is held twice or the contact model is not usable.
        """
        for item in contacts:
            if not isinstance(item, Contact):
                raise ContactError(f"stance contains {item!r}; valid: contacts made by sole, point or grasp")
        names = [contact.effector for contact in contacts]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ContactError(f"stance holds effector {twice[0]!r} twice; valid: one contact per effector")
        object.__setattr__(self, "contacts", tuple(contacts))
        object.__setattr__(self, "model", model or ContactModel(friction_model, normal_force_cap))

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

    @property
    def normal_force_cap(self) -> float | None:
        """Largest sum of the normal forces of all soles and points [N]; None leaves it to the contacts."""
        return self.model.normal_force_cap

    @property
    def friction_model(self) -> FrictionModel:
        """Friction model of all its soles and points."""
        return self.model.friction

    def with_contacts(self, contacts: Iterable[Contact]) -> "Stance":
        """Other contacts under the same contact model."""
        return Stance(tuple(contacts), model=self.model)

    def with_friction_model(self, friction: FrictionModel) -> "Stance":
        """The same contacts and caps under another friction model."""
        return Stance(self.contacts, model=replace(self.model, friction=friction))

    def bounded(self, mass: float) -> "Stance":
        """The stance itself, or with the default cap of a body where a normal force has no cap.

        Args:
            mass: Of the body [kg].
        """
        if self.normal_force_cap is not None or all(
            contact.kind is ContactKind.GRASP or contact.normal_force_cap is not None for contact in self
        ):
            return self
        cap = default_normal_force_cap(mass)
        return Stance(self.contacts, model=replace(self.model, normal_force_cap=cap))
