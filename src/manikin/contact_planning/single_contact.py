"""One task-efficient contact of a scenario: what ``manikin contact`` answers."""

import time
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from manikin.body import BodyModel, Configuration, LimbKinematics, limb_named
from manikin.body.limbs import parent_segment
from manikin.contact import ContactKind
from manikin.contact_planning.efort import Task, efort
from manikin.contact_planning.generator import ContactGenerator, GeneratedContact
from manikin.contact_planning.heuristics import Heuristic, heuristic_named
from manikin.contact_planning.samples import sample_limb
from manikin.contact_planning.touch import ContactRules
from manikin.errors import BodyError, InputError
from manikin.scene import Scene
from manikin.spatial import FloatArray

SOME_EFORT = 1e-9
"""What is less comes from rounding, as on a face along the task [N per N.m]."""


class Role(StrEnum):
    """What a limb does with its contact; decides the sign of EFORT's direction."""

    AUTO = "auto"
    """The body where some contact scores above zero that way, else the object; feet: the body."""
    BODY = "body"
    """Moves or braces the body along the task."""
    OBJECT = "object"
    """Pushes an object along the task."""


@dataclass(frozen=True)
class ContactQuestion:
    """What is asked of one limb.

    Attributes:
        limb: Name of the limb.
        task: Direction of the task in the world; its length does not count.
        role: What the limb does.
        pulling: Whether it holds on and pulls instead of pressing (5.13).
        heuristic: Name of the preference, one of :data:`manikin.contact_planning.HEURISTICS`.
        kind: How the effector touches; its own way when None.
        samples: Number of samples of the limb.
        seed: Of the samples and of the random heuristic.
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
        limb: str,
        task: tuple[float, float, float],
        role: str = "auto",
        pulling: bool = False,
        heuristic: str = "efort",
        kind: str | None = None,
        samples: int = 10_000,
        seed: int = 0,
    ) -> "ContactQuestion":
        """Question from words.

        Raises:
            InputError: If a word is not known.
        """
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
        question: What was asked.
        q: (nq,) the body before.
        result: The generator's answer.
        role: The role that was taken, never ``auto``.
        efort: EFORT of the posture found, with the sign of that role [N per N.m]; None without one.
        prepare_wall_s: Wall time of the samples, the scene's preparation and a first request [s].
        wall_s: Wall time of the request, made again [s].
    """

    question: ContactQuestion
    q: FloatArray
    result: GeneratedContact
    role: Role
    efort: float | None
    prepare_wall_s: float
    wall_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON; the keys are documented in ``docs/json.md``."""
        found, contact = self.result, self.result.contact
        return {
            "found": found.found,
            "position": None if contact is None else contact.position,
            "normal": None if contact is None else contact.normal,
            "obstacle": found.obstacle,
            "efort": self.efort,
            "candidates": found.candidates,
            "wall_ms": 1e3 * self.wall_s,
            "failure": None if found.found else found.message,
            "hindrance": None if found.failure is None else str(found.failure),
            "limb": found.limb,
            "kind": None if contact is None else str(contact.kind),
            "role": str(self.role),
            "heuristic": self.question.heuristic,
            "score": found.score if found.found else None,
            "gap_m": found.gap if found.found else None,
            "tried": found.tried,
            "samples": self.question.samples,
            "seed": self.question.seed,
            "prepare_wall_ms": 1e3 * self.prepare_wall_s,
            "q": found.q,
        }


def find_contact(
    body: BodyModel,
    scene: Scene,
    q: FloatArray,
    question: ContactQuestion,
    rules: ContactRules | None = None,
) -> ContactAnswer:
    """Answer one question about a body in a scene.

    Args:
        body: A body with limbs.
        scene: Its surroundings.
        q: (nq,) the body; all but the limb stays as it is.
        question: What is asked.
        rules: What contacts can carry.

    Raises:
        InputError: If the limb or the heuristic is not known, the direction is zero, or the limb has
            no such contact.
    """
    check_limbs(body)
    limb = limb_named(body, question.limb)
    roles = _roles(question, limb.kind)
    tasks = [_task(question, role) for role in roles]
    heuristic = heuristic_named(question.heuristic, question.seed, pulling=question.pulling)
    started = time.perf_counter()
    samples = sample_limb(body, limb, np.random.default_rng(question.seed), question.samples)
    generator = ContactGenerator(body, scene, {limb.name: samples}, rules=rules)
    _ask(generator, q, question, heuristic, roles, tasks)  # as in a dialogue, where caches are filled
    prepared = time.perf_counter()
    found, wall = _ask(generator, q, question, heuristic, roles, tasks)
    role, result, score = max(found, key=lambda item: -np.inf if item[2] is None else item[2])
    return ContactAnswer(question, np.array(q), result, role, score, prepared - started, wall)


def check_limbs(body: BodyModel) -> None:
    """Check that a body has limbs that can make contacts.

    Raises:
        BodyError: If it has none.
    """
    if not body.limbs:
        raise BodyError(f"body {body.name!r} has no limbs; valid: a body with limbs, such as a human")


def _ask(
    generator: ContactGenerator,
    q: FloatArray,
    question: ContactQuestion,
    heuristic: Heuristic,
    roles: tuple[Role, ...],
    tasks: list[Task],
) -> tuple[list[tuple[Role, GeneratedContact, float | None]], float]:
    """Answers for one role after the other, until one has a positive EFORT; wall time of the requests [s]."""
    kind = question.kind or (ContactKind.GRASP if question.pulling else None)
    found: list[tuple[Role, GeneratedContact, float | None]] = []
    wall = 0.0
    for role, task in zip(roles, tasks, strict=True):
        started = time.perf_counter()
        result = generator.request(q, question.limb, task, heuristic, kind=kind)
        wall += time.perf_counter() - started
        found.append((role, result, reached_efort(generator.body, result, task, pulling=question.pulling)))
        if (found[-1][2] or 0.0) > SOME_EFORT:
            break
    return found, wall


def reached_efort(
    body: BodyModel, result: GeneratedContact, task: Task, *, pulling: bool = False
) -> float | None:
    """EFORT (5.12) of the posture of a contact that was found, or None without one [N per N.m]."""
    if result.q is None or result.contact is None:
        return None
    limb = limb_named(body, result.limb)
    chain = LimbKinematics(body, limb)
    jacobian = chain.place(result.q[None, chain.slots]).jacobians[0]
    turn, _ = Configuration(body, result.q).segment_placement(parent_segment(body, limb))
    direction, normal = task.reaction_on(limb.name) @ turn, result.contact.normal @ turn
    value = float(efort((jacobian @ jacobian.T)[None], direction, normal[None])[0])
    return -value if pulling else value


def _roles(question: ContactQuestion, kind: ContactKind) -> tuple[Role, ...]:
    if question.role is not Role.AUTO:
        return (question.role,)
    return (Role.BODY,) if kind is ContactKind.SOLE else (Role.BODY, Role.OBJECT)


def _task(question: ContactQuestion, role: Role) -> Task:
    try:
        return Task(question.task, {question.limb} if role is Role.OBJECT else ())
    except InputError as error:
        raise InputError(str(error).replace("task direction", "task", 1)) from None
