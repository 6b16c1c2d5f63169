"""Contact of one limb for one task, as ``manikin contact`` asks for it."""

import time
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Limb, limb_named
from manikin.contact import ContactKind
from manikin.errors import BodyError, InputError
from manikin.kinematics.efort import Task, unit_direction, usable_efort
from manikin.kinematics.limb_samples import sample_limb
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import ContactRules
from manikin.planning.contacts.generator import ContactGenerator, GeneratedContact, UsableEfort
from manikin.planning.contacts.heuristics import Heuristic, heuristic_named
from manikin.scene import Scene


class Role(StrEnum):
    """Use that a limb makes of its contact; it decides the sign of EFORT's direction."""

    AUTO = "auto"  # the body where some contact is usable that way, else the object; feet: the body
    BODY = "body"  # moves or braces the body along the task
    OBJECT = "object"  # pushes an object along the task


_FARTHEST = ("reach", "surface", "direction", "alignment", "collision")  # how far a request that failed came


@dataclass(frozen=True)
class ContactQuestion:
    """Request for a contact of one limb.

    Attributes:
        task: Direction of the task in the world; its length does not count.
        role: What the limb does.
        pulling: Whether it holds on and pulls instead of pressing (5.13).
        heuristic: Name of the preference, one of :data:`manikin.planning.contacts.HEURISTICS`.
        kind: How the effector touches; its own way when None.
        samples: Number of samples of the limb.
        seed: Seed of the samples and of the random heuristic.
    """

    limb: str
    task: tuple[float, float, float]
    role: Role = Role.AUTO
    pulling: bool = False
    heuristic: str = "efort"
    kind: ContactKind | None = None
    samples: int = 10_000
    seed: int = 0

    @staticmethod
    def of(
        limb: str, task: tuple[float, float, float], role: str = "auto", pulling: bool = False,
        heuristic: str = "efort", kind: str | None = None, samples: int = 10_000, seed: int = 0,
    ) -> "ContactQuestion":  # fmt: skip
        """Question from words; an InputError if one is not known."""
        if role not in list(Role):
            raise InputError(f"role is {role!r}; valid: {', '.join(Role)}")
        if kind is not None and kind not in list(ContactKind):
            raise InputError(f"kind is {kind!r}; valid: {', '.join(ContactKind)}")
        touch = None if kind is None else ContactKind(kind)
        return ContactQuestion(limb, task, Role(role), pulling, heuristic, touch, samples, seed)


@dataclass(frozen=True, eq=False)
class ContactAnswer:
    """The contact found, or why there is none.

    Attributes:
        q: (nq,) the body before.
        role: The role that was taken, never ``auto``.
        efort: EFORT of the posture found, with the sign of that role, usable or more [N per N.m]; None
            without one.
        usable: See :func:`manikin.kinematics.efort.usable_efort` [N per N.m].
        prepare_wall_s: Wall time of the samples, the scene's preparation and a first request [s].
        wall_s: Wall time of the request, made again [s].
    """

    question: ContactQuestion
    q: FloatArray
    result: GeneratedContact
    role: Role
    efort: float | None
    usable: float
    prepare_wall_s: float
    wall_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON; the keys are documented in ``docs/json.md``."""
        result, contact = self.result, self.result.contact
        return {
            "found": result.found,
            "position": None if contact is None else contact.position,
            "normal": None if contact is None else contact.normal,
            "obstacle": result.obstacle, "efort": self.efort, "usable_efort": self.usable,
            "candidates": result.candidates, "wall_ms": 1e3 * self.wall_s,
            "failure": None if result.found else result.message,
            "hindrance": None if result.failure is None else str(result.failure),
            "limb": result.limb, "kind": None if contact is None else str(contact.kind),
            "role": str(self.role), "heuristic": self.question.heuristic,
            "score": result.score if result.found else None, "gap_m": result.gap if result.found else None,
            "tried": result.tried, "samples": self.question.samples, "seed": self.question.seed,
            "prepare_wall_ms": 1e3 * self.prepare_wall_s, "q": result.q,
        }  # fmt: skip


def find_contact(
    body: BodyModel, scene: Scene, q: FloatArray, question: ContactQuestion, rules: ContactRules | None = None
) -> ContactAnswer:
    """Answer one question about a body (nq,) in a scene, of which all but the limb stays as it is.

    Raises:
        InputError: If the limb or the heuristic is not known, the direction is zero, or the limb has
            no such contact.
    """
    check_limbs(body)
    limb = limb_named(body, question.limb)
    unit_direction(question.task, "task")
    heuristic = heuristic_named(question.heuristic, question.seed, pulling=question.pulling)
    kind = question.kind or (ContactKind.GRASP if question.pulling else None)
    started = time.perf_counter()
    samples = sample_limb(body, limb, np.random.default_rng(question.seed), question.samples)
    generator = ContactGenerator(body, scene, {limb.name: samples}, rules=rules)
    usable = UsableEfort(usable_efort(body, limb), question.pulling)
    ask = partial(ask_limb, generator, q, limb, question.task, question.role, heuristic, kind, usable)
    ask()  # as in a dialogue, where caches are filled
    prepared = time.perf_counter()
    role, result, value = ask()
    wall = time.perf_counter() - prepared
    return ContactAnswer(question, np.array(q), result, role, value, usable.least, prepared - started, wall)


def check_limbs(body: BodyModel) -> None:
    """Raise a BodyError if a body has no limbs that could make contacts."""
    if not body.limbs:
        raise BodyError(f"body {body.name!r} has no limbs; valid: a body with limbs, such as a human")


def ask_limb(
    generator: ContactGenerator, q: FloatArray, limb: Limb, direction: ArrayLike, role: Role,
    heuristic: Heuristic, kind: ContactKind | None, usable: UsableEfort,
) -> tuple[Role, GeneratedContact, float | None]:  # fmt: skip
    """First role with a usable contact, the answer, and its EFORT with the sign of the role [N per N.m].

    A failure in both roles says both causes; the hindrance is that of the role that came farthest.
    """
    both = role is Role.AUTO and limb.kind is not ContactKind.SOLE
    roles = (Role.BODY, Role.OBJECT) if both else (Role.BODY if role is Role.AUTO else role,)
    tasks = [Task(direction, {limb.name} if each is Role.OBJECT else ()) for each in roles]
    answers = generator.request_first(q, limb.name, tasks, heuristic, kind=kind, usable=usable)
    result = answers[-1]
    if result.efort is not None:
        return roles[len(answers) - 1], result, usable.signed(result.efort)
    farthest = max(range(len(answers)), key=lambda row: _FARTHEST.index(answers[row].failure or "collision"))
    does = "to move the body", "to act on an object"  # both roles are asked where there are two answers
    causes = [f"{what}, {item.message}" for what, item in zip(does, answers, strict=False)]
    message = result.message if len({item.message for item in answers}) == 1 else "; ".join(causes)
    return roles[farthest], replace(answers[farthest], message=message), None
