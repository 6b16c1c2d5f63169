"""Exceptions: each says what was wrong, where, and what would be valid.

A planner that finds nothing does not raise; it returns a result that explains
itself.  Exceptions are for misuse and for broken input.
"""


class ManikinError(Exception):
    """Base of every exception that manikin raises on purpose."""


class InputError(ManikinError):
    """A value given by the caller or read from a file is not usable.

    The message is one line that names the place, the offending value and the
    valid values.  The command line prints it and exits with status 2.
    """


class BodyError(InputError):
    """A body description (stature, mass, sex, limbs, joints) is not usable."""


class SceneError(InputError):
    """An obstacle, a mesh file or a support surface is not usable."""


class ContactError(InputError):
    """A contact, stance or stance sequence is not usable."""


class ScenarioError(InputError):
    """A scenario file is malformed; the message names file, key and remedy."""


class MotionFileError(InputError):
    """A motion file or run directory cannot be read or written."""


class FigureError(InputError):
    """A run lacks what a figure shows; the message names it."""


class PolytopeError(ManikinError):
    """A polytope is empty, unbounded or numerically degenerate beyond repair."""


class SplineError(InputError):
    """Degree, knots or control points do not make a clamped B-spline."""


class SolverError(ManikinError):
    """A numerical solver failed for a reason that is not infeasibility."""


class TimeLimitError(ManikinError):
    """Work did not end within the time it was given."""
