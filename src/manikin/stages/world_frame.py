"""Results of a run in the world: what was found in the frame of the task, moved to where that is."""

import re
from dataclasses import replace

from manikin.centroidal import CentroidalTrajectory
from manikin.contact import Contact, ContactSchedule, Stance, StanceSequence
from manikin.motion import Motion
from manikin.spatial import PlanarTransform, frozen_array
from manikin.spline import BSpline

_PLACE = re.compile(r"\[(-?\d[\d.e+-]*(?:, -?\d[\d.e+-]*){1,2})\]")
"""A position as the stages write it into their reasons: two or three numbers in brackets."""


def motion_in_world(motion: Motion, transform_task_to_world: PlanarTransform) -> Motion:
    """A motion with its root, centre of mass, momentum and contact forces in the world."""
    transform = transform_task_to_world
    if transform.is_identity:
        return motion
    forces = motion.contact_force.reshape(*motion.contact_force.shape[:-1], 2, 3)
    return replace(
        motion,
        q=transform.poses(motion.q),
        com=transform.points(motion.com),
        angular_momentum=transform.directions(motion.angular_momentum),
        contact_force=transform.directions(forces).reshape(motion.contact_force.shape),
    )


def schedule_in_world(schedule: ContactSchedule, transform_task_to_world: PlanarTransform) -> ContactSchedule:
    """Contacts in time, where they are in the world."""
    if transform_task_to_world.is_identity:
        return schedule
    # A contact that several phases hold stays one.
    moved: dict[int, Contact] = {}
    phases = []
    for phase in schedule.sequence:
        for contact in phase.stance:
            if id(contact) not in moved:
                moved[id(contact)] = contact_in_world(contact, transform_task_to_world)
        stance = Stance([moved[id(contact)] for contact in phase.stance], model=phase.stance.model)
        phases.append(replace(phase, stance=stance))
    return ContactSchedule(StanceSequence(phases), schedule.instants)


def contact_in_world(contact: Contact, transform_task_to_world: PlanarTransform) -> Contact:
    """A contact at its place in the world."""
    rotation = transform_task_to_world.rotations(contact.rotation_contact_to_world)
    return replace(
        contact,
        position=frozen_array(transform_task_to_world.points(contact.position), "contact position"),
        rotation_contact_to_world=frozen_array(rotation, "contact rotation"),
    )


def trajectory_in_world(
    trajectory: CentroidalTrajectory, transform_task_to_world: PlanarTransform
) -> CentroidalTrajectory:
    """A trajectory of the centre of mass with its contacts in the world."""
    transform, spline, turning = transform_task_to_world, trajectory.spline, trajectory.turning
    if transform.is_identity:
        return trajectory
    return replace(
        trajectory,
        spline=BSpline(spline.degree, spline.knots, transform.points(spline.control_points)),
        schedule=schedule_in_world(trajectory.schedule, transform),
        turning=None if turning is None
        else BSpline(turning.degree, turning.knots, transform.directions(turning.control_points)),
    )  # fmt: skip


def reason_in_world(reason: str, transform_task_to_world: PlanarTransform) -> str:
    """A reason in one line with the positions in it in the world.

    Positions are what the stages write as two or three numbers in brackets, ``[1.2, 0.5]``; they keep their
    number of digits.
    """
    if transform_task_to_world.is_identity:
        return reason

    def moved(found: re.Match[str]) -> str:
        numbers = found[1].split(", ")
        digits = max(len(number.partition(".")[2]) for number in numbers)
        x, y = transform_task_to_world.points([float(number) for number in numbers[:2]])
        return f"[{', '.join([str(round(float(value), digits) + 0.0) for value in (x, y)] + numbers[2:])}]"

    return _PLACE.sub(moved, reason)
