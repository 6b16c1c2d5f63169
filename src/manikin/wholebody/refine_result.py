"""What a refinement is asked for and what it finds."""

from collections.abc import Callable
from dataclasses import dataclass, field

from manikin.contact import ContactSchedule
from manikin.display import Displayed
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.requirement import RequirementTable
from manikin.spatial import finite_number
from manikin.wholebody.configuration_spline import ConfigurationSpline
from manikin.wholebody.failure import WholeBodyFailure
from manikin.wholebody.refine_certificate import RefineRequirements, RefineResiduals
from manikin.wholebody.refine_measures import RefineMeasures
from manikin.wholebody.refine_scales import RefineScales
from manikin.wholebody.refine_variables import Variables

Progress = Callable[[float], None]
"""Told the share of the work that is done, in [0, 1]."""


@dataclass(frozen=True)
class RefineSettings:
    """Options of :func:`refine_motion`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        samples_per_span: Samples between two knots.
        sampling: Spacing of the finished motion's samples, at which it is certified [s].
        scales: Weights and limits of the fit.
        requirements: What the finished motion must keep.
        retime: Whether the motion may be slowed down.
        friction_share: Share of the friction with which the margin is wanted; the certificate has all of it.
        contact_variables: Whether contacts that the motion does not need, and whose effectors are not there,
            are let go; else all contacts of the sequence are held.
        speed_share: Share of the velocity limits up to which phases are shortened, as far as every
            requirement is kept; None leaves them as they are.
    """

    knot_spacing: float = 0.1
    samples_per_span: int = 3
    sampling: float = 5.0e-3
    scales: RefineScales = field(default_factory=RefineScales)
    requirements: RefineRequirements = field(default_factory=RefineRequirements)
    retime: bool = True
    friction_share: float = 0.8
    contact_variables: bool = True
    speed_share: float | None = None

    def __post_init__(self) -> None:
        if self.speed_share is not None:
            share = finite_number(self.speed_share, "refinement speed_share", above=0.0)
            if share > 1.0:
                raise InputError(f"refinement speed_share is {share:g}; valid: at most 1")


@dataclass(frozen=True, eq=False, repr=False)
class RefineResult(Displayed):
    """A refined motion, or the best attempt and what it breaks.

    Attributes:
        motion: Densely sampled; its time begins where the input's does.
        spline: The motion in closed form.
        schedule: The contacts in the motion's own time, without those that were let go.
        before: The input at the motion's own timing, joined by interpolation.
        smoothed: The spline through the input from which the optimisation begins.
        after: The refined motion.
        certificate: Measured on the samples of the motion.
        requirements: What the certificate and the contacts' limits were held against.
        contact_slack: Room that all limits of the contacts have in common, the least at samples 10 ms
            apart, by linear programs, see :mod:`manikin.wholebody.contact_slack` [N, N.m].
        failure: Why it is no success, or None.
        variables: Of each phase, the contact variable of each contact of the input's sequence, in [0, 1].
        released: Phases and effectors of the contacts that were let go.
        stretch: Duration of the motion relative to the input's.
        iterations: Gauss-Newton steps.
        wall_time: [s].
    """

    motion: Motion
    spline: ConfigurationSpline
    schedule: ContactSchedule
    before: RefineMeasures
    smoothed: RefineMeasures
    after: RefineMeasures
    certificate: RefineResiduals
    requirements: RequirementTable
    contact_slack: float
    failure: WholeBodyFailure | None
    variables: Variables
    released: tuple[tuple[int, str], ...]
    stretch: float
    iterations: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether every requirement is kept."""
        return self.failure is None
