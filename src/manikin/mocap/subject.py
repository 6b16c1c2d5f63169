"""What a file says about the person recorded."""

from dataclasses import dataclass, fields

from manikin.errors import InputError
from manikin.spatial import finite_number


@dataclass(frozen=True)
class Subject:
    """Measures of a person; None where the file does not say.

    Attributes:
        mass: Of the body [kg].
        stature: Sole to vertex [m].
        knee_width: Between the epicondyles of a knee [m].
        ankle_width: Between the malleoli [m].
        elbow_width: Between the epicondyles of an elbow [m].
        shoulder_offset: From the marker on the acromion down to the joint's centre [m].
        marker_radius: Of a marker [m].
    """

    mass: float | None = None
    stature: float | None = None
    knee_width: float | None = None
    ankle_width: float | None = None
    elbow_width: float | None = None
    shoulder_offset: float | None = None
    marker_radius: float | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and finite_number(value, f"subject {field.name}") <= 0.0:
                raise InputError(f"subject {field.name} is {value!r}; valid: above 0, or None")


UNKNOWN = Subject()
"""Nothing is said."""
