"""A whole-body motion sampled in time, with its contacts, forces and margin."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from manikin.display import Displayed
from manikin.errors import MotionFileError
from manikin.spatial import FloatArray

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Displayed):
    """Samples of one motion, planned or executed.

    Configuration vectors follow Pinocchio: ``q = [pelvis position, xyzw quaternion, joint
    angles]``; ``v`` and ``a`` hold the pelvis' linear and angular parts in the *pelvis*
    frame, then the joints' rates. All other quantities are in the world frame.

    Attributes:
        time: (n,) increasing [s].
        q: (n, nq) configurations [m, -, rad].
        v: (n, nv) velocities [m/s, rad/s].
        a: (n, nv) accelerations [m/s^2, rad/s^2].
        tau: (n, nv) generalised forces; the first six (pelvis) are zero [N, N.m].
        com: (n, 3) centre of mass [m].
        angular_momentum: (n, 3) about the centre of mass [kg.m^2/s].
        margin: (n,) wrench margin about the CoM, alpha = 1 m [N.m]; of a point mass
            planned in the force space, the force margin at the CoM [N].
        support: (n, c) True where the contact is active.
        contact_force: (n, c, 6) force [N] and moment [N.m] of the scene on the body,
            moment about the contact frame's origin.
        contact_names: c effector names.
        joint_names: nv - 6 hinge names, in the order of ``q[7:]``.
        margin_unit: ``"N.m"`` or ``"N"``.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray
    com: FloatArray
    angular_momentum: FloatArray
    margin: FloatArray
    support: NDArray[np.bool_]
    contact_force: FloatArray
    contact_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    margin_unit: str = "N.m"

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {
            "duration": f"{self.duration:.2f} s", "samples": str(len(self.time)),
            "hinges": str(len(self.joint_names)), "contacts": " ".join(self.contact_names),
        }  # fmt: skip

    def __post_init__(self) -> None:
        n, c, nv = len(self.time), len(self.contact_names), len(self.joint_names) + 6
        wanted = {
            "time": (n,), "q": (n, nv + 1), "v": (n, nv), "a": (n, nv), "tau": (n, nv), "com": (n, 3),
            "angular_momentum": (n, 3), "margin": (n,), "support": (n, c), "contact_force": (n, c, 6),
        }  # fmt: skip
        if n == 0:
            raise MotionFileError("motion has no samples; valid: at least one")
        for name, shape in wanted.items():
            dtype = np.bool_ if name == "support" else np.float64
            array = np.array(getattr(self, name), dtype=dtype)
            if array.shape != shape:
                raise MotionFileError(f"motion {name} has shape {array.shape}; valid: {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if n > 1 and not np.all(np.diff(self.time) > 0):
            raise MotionFileError("motion time does not increase; valid: strictly increasing seconds")

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    def to_frame(self) -> "DataFrame":
        """Table with one row for each sample, indexed by time; units stand in the names of the columns."""
        from pandas import DataFrame, Index

        root = {f"pelvis_{axis}_m": self.q[:, k] for k, axis in enumerate("xyz")}
        root |= {f"pelvis_q{axis}": self.q[:, 3 + k] for k, axis in enumerate("xyzw")}
        columns = {f"com_{axis}_m": self.com[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"margin_{self.margin_unit}": self.margin} | root
        for k, name in enumerate(self.joint_names):
            columns |= {f"{name}_rad": self.q[:, 7 + k], f"{name}_Nm": self.tau[:, 6 + k]}
        for k, name in enumerate(self.contact_names):
            forces = {f"{name}_force_{axis}_N": self.contact_force[:, k, i] for i, axis in enumerate("xyz")}
            columns |= {f"{name}_touches": self.support[:, k]} | forces
        return DataFrame(columns, index=Index(self.time, name="time_s"))

    def arrays(self) -> dict[str, NDArray]:
        """The array fields by name, in their order of declaration."""
        return {
            f.name: getattr(self, f.name)
            for f in fields(self)
            if isinstance(getattr(self, f.name), np.ndarray)
        }
