"""MuJoCo without its log file."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Context in which MuJoCo's warnings leave no ``MUJOCO_LOG.TXT`` in the working directory."""
    import mujoco  # here, so that what needs no engine does not wait for it

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
