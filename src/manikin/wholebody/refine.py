"""Refine a sequence of key configurations into a smooth motion that keeps to physics ([Tonneau2015]_ 7.3).

The third stage of the thesis hands the contact sequence to a trajectory optimisation (ITOMP) and reports that
this "is not fully functional"; the optimisation here is our own, with the terms of 7.3.1 and 7.3.2 on the
machine of the whole-body fit: one quintic spline, analytic Gauss-Newton steps, contacts made exact by
multipliers.
"""

import time as clock
from collections.abc import Sequence

from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.contact_planning.efort import Task
from manikin.scene import Scene
from manikin.wholebody.refine_input import KeyPath, check_input
from manikin.wholebody.refine_job import Refinement
from manikin.wholebody.refine_result import Progress, RefineResult, RefineSettings
from manikin.wholebody.refine_scales import RefineScales


def refine_motion(
    body: BodyModel,
    scene: Scene,
    time: ArrayLike,
    q: ArrayLike,
    schedule: ContactSchedule,
    *,
    settings: RefineSettings | None = None,
    task: Task | None = None,
    padded: Sequence[str] = (),
    progress: Progress | None = None,
) -> RefineResult:
    """Turn key configurations and their contacts into a smooth motion in balance and without collision.

    Args:
        body: The body.
        scene: The obstacles and the floor.
        time: (n,) times of the key configurations [s].
        q: (n, nq) key configurations, joined by interpolation.
        schedule: Which effector holds which contact when, over the same interval; full soles only.
        settings: Options.
        task: Direction of EFORT; the pelvis' displacement in each phase when omitted (7.9).
        padded: Obstacles that any part of the body may lean on.
        progress: Called now and then with the share done.

    Returns:
        The motion with its certificate and the measures of every term before and after.  Where a
        requirement breaks, its weight grows, the spline gets more knots, or the phase lasts longer.

    Raises:
        InputError: If keys, contacts and body do not fit each other.
        ContactError: If nothing bounds the normal force of a contact, or it lies on no obstacle.
    """
    began = clock.perf_counter()
    path = KeyPath(time, q)
    check_input(body, path, schedule)
    job = Refinement(
        body,
        scene,
        path,
        schedule,
        settings or RefineSettings(scales=RefineScales.of(body)),
        task,
        tuple(padded),
    )
    return job.run(began, progress or _silent)


def _silent(share: float) -> None:
    del share
