"""What a motion does not tell and an observer would write down: load, grip, repetition."""

from dataclasses import dataclass

from manikin.errors import InputError
from manikin.spatial import finite_number

PATTERNS = ("intermittent", "static", "shock")
COUPLINGS = ("good", "fair", "poor", "unacceptable")


@dataclass(frozen=True)
class Circumstances:
    """Circumstances of a task; the default is nothing in the hands, done once.

    Attributes:
        load_kg: Load or force on hands or back [kg].
        load_pattern: ``"intermittent"``; ``"static"``, for repeated ones too; or ``"shock"``, also for a
            force that builds up rapidly.
        coupling: Hold on the load, one of :data:`COUPLINGS` ([Hignett2000]_ Table 2).
        static: Whether the posture is held for more than a minute, of a motion too short to show it.
        repeated: Whether an action is repeated more than four times a minute.
        rapid: Whether the action causes rapid large changes of posture, or stands on an unstable base.
        shoulder_raised: Whether a shoulder is raised: our bodies have no shoulder girdle to show it.
        trunk_supported: Whether the trunk of somebody seated is well supported.
        neck_upright_deg: Flexion of the body's neck when it is upright; of a recording see
            :func:`manikin.ergonomics.postural_angles.upright_neck` [deg].
    """

    load_kg: float = 0.0
    load_pattern: str = "intermittent"
    coupling: str = "good"
    static: bool = False
    repeated: bool = False
    rapid: bool = False
    shoulder_raised: bool = False
    trunk_supported: bool = False
    neck_upright_deg: float = 0.0

    def __post_init__(self) -> None:
        finite_number(self.load_kg, "load [kg]", at_least=0.0)
        finite_number(self.neck_upright_deg, "upright neck [deg]", at_least=-60.0, at_most=60.0)
        for name, value, valid in (
            ("load pattern", self.load_pattern, PATTERNS),
            ("coupling", self.coupling, COUPLINGS),
        ):
            if value not in valid:
                raise InputError(f"{name} is {value!r}; valid: {', '.join(valid)}")
