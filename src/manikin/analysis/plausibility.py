"""What no person does: results that say that a recording was not read or not followed rightly.

The limits are beyond what people do, so that no motion of a person is refused: forces under sprinters
and jumpers are some 5 to 10 body weights, the fastest sprinter covers 12.4 m/s, and hands that throw reach
some 25 m/s.
"""

from collections.abc import Iterator

import numpy as np

from manikin.body import BodyModel
from manikin.numerics.spatial import GRAVITY, FloatArray, wrench_about
from manikin.recordings.dynamics.recorded_dynamics import RecordedDynamics
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import RecordedSupports
from manikin.recordings.supports.support_levels import effector_places

LARGEST_LOAD, FASTEST_BODY, FASTEST_LIMB = 20.0, 15.0, 30.0
"""External force per body weight, speeds of the centre of mass, and of hands and feet [m/s]: nobody's."""

LARGEST_TURNING = 5.0
"""Moment about the centre of mass per body weight that nobody's motion needs [m]; our choice."""

LONGEST_FALL = 0.5
"""Time without any support that a jump of a person may last [s]."""

LIMBS = ("left_foot", "right_foot", "left_hand", "right_hand")


def implausible(
    found: Reconstruction, dynamics: RecordedDynamics, supports: RecordedSupports
) -> tuple[str, ...]:
    """Results beyond people's, a line each with the largest value and its instant.

    Args:
        found: The motion as it was recorded.
        dynamics: The same, smoothed.
        supports: What was found to carry it, on the recording's clock.
    """
    return (*_jumps(found), *_findings(dynamics, supports.start), *_unsupported(supports))


def _jumps(found: Reconstruction) -> Iterator[str]:
    """The largest jump of a joint that stays in the motion, if it is faster than limbs are."""
    jumps = [(one.distance or 0.0, one) for one in found.repairs if one.kind == "jump"]
    distance, largest = max(jumps, key=lambda jump: jump[0], default=(0.0, None))
    if largest is not None and distance * found.rate > FASTEST_LIMB:
        yield (
            f"{largest.marker} jumps after frame {largest.first}, and what it carries by {distance:.2f} m: "
            "no person does that; forces and margins near there are not to be believed"
        )


def _unsupported(supports: RecordedSupports) -> Iterator[str]:
    """Whether nothing is found to carry for the whole of a recording."""
    duration = supports.end - supports.start
    if not supports.supports and duration > LONGEST_FALL:
        yield (
            f"no support was found in {duration:.2f} s: nobody stays in the air for so long; forces, margins "
            "and torques are those of a body in flight; are the feet recorded, and is the ground level?"
        )


def _findings(dynamics: RecordedDynamics, start: float) -> Iterator[str]:
    step = float(dynamics.time[1] - dynamics.time[0])
    weight = GRAVITY * dynamics.body.mass
    load = np.linalg.norm(dynamics.wrench[:, :3], axis=1) / weight
    turning = np.linalg.norm(wrench_about(dynamics.wrench, dynamics.com)[:, 3:], axis=1) / weight
    yield from _beyond("external force", load, LARGEST_LOAD, "body weights", dynamics.time + start)
    moment = "moment about the centre of mass"
    yield from _beyond(moment, turning, LARGEST_TURNING, "body weights times a metre", dynamics.time + start)
    speed = np.linalg.norm(np.gradient(dynamics.com, step, axis=0), axis=1)
    yield from _beyond("speed of the centre of mass", speed, FASTEST_BODY, "m/s", dynamics.time + start)
    for name, places in _limbs(dynamics.body, dynamics.q):
        speed = np.linalg.norm(np.gradient(places, step, axis=0), axis=1)
        yield from _beyond(f"speed of the {name}", speed, FASTEST_LIMB, "m/s", dynamics.time + start)


def _limbs(body: BodyModel, q: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    for name, places in zip(LIMBS, effector_places(body, q, LIMBS), strict=True):
        yield name.replace("_", " "), places


def _beyond(what: str, values: FloatArray, most: float, unit: str, time: FloatArray) -> Iterator[str]:
    """The largest of values that exceed what people reach."""
    largest = int(np.argmax(values))
    if values[largest] > most:
        share = 100.0 * float(np.mean(values > most))
        yield (
            f"{what} of {values[largest]:.1f} {unit} at {time[largest]:.2f} s, beyond {most:g} in "
            f"{share:.1f} % of the frames: no person does that; are markers, units, rate and mass right?"
        )
