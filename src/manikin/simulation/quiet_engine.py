"""MuJoCo without its log file."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Context in which a simulation that diverges leaves no ``MUJOCO_LOG.TXT`` in the working directory.

    :attr:`manikin.simulation.world.World.divergence` says the same.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_nobody)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _nobody(_message: str) -> None:
    """Tell nobody."""
