"""Plan, prove and measure how a body moves through a cluttered scene."""

from typing import TYPE_CHECKING, Any

from manikin.version import __version__

if TYPE_CHECKING:
    from manikin.stages import RunResult

__all__ = ["__version__", "run"]


def run(scenario: Any, **options: Any) -> "RunResult":
    """Plan a scenario, execute it in the physics engine and report; see :func:`manikin.pipeline.run`."""
    from manikin.pipeline import run as run_pipeline  # the engines load only when they are needed

    return run_pipeline(scenario, **options)
