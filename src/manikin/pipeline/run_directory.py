"""Run directory: the files of one run, and the run read back from them.

::

    DIR/scenario.yaml      the scenario with every default and override, ready to run again
    DIR/stages/*.json      what each stage found, written as soon as it is known
    DIR/contacts.json      contacts that were planned, with their postures (manikin.verification)
    DIR/motion.h5          planned motion, then planned and executed (manikin.motion.file)
    DIR/motion-NAME.h5     planned motion of another walker
    DIR/adaptation.json    what has changed from the recording, of an adapted one
    DIR/summary.json       written when every stage is done
    DIR/report.html        verdict, requirements, figures and numbers in one page that needs no other file
    DIR/motion.bvh         drawn from the files above, for animation programs
    DIR/figures/*.png      drawn from the files above

Each file is written atomically, so an interrupted run leaves whole files of the stages that were done.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from manikin.balance import WrenchPolytope, pseudo_wrench
from manikin.balance.zmp import ZmpPath, contact_wrench, zmp_path
from manikin.body import BodyModel
from manikin.contact import ContactSchedule, StanceSequence
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.motion.file import MotionFile, read_motions
from manikin.motion.motion import PhaseTable, com_velocity, effector_positions, phases_of
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.com_certificate import phase_margins, phase_times
from manikin.planning.com.feasibility import polytopes_of
from manikin.runtime.display import Displayed
from manikin.runtime.files import FIGURES, ResultDirectory, read_json
from manikin.scenarios import load_scenario
from manikin.scene import Scene

COM_TRAJECTORY = "com_trajectory.json"


@dataclass(frozen=True, eq=False)
class ComTrack:
    """The centre of mass in time, with its margin.

    Attributes:
        time: (n,) not decreasing [s].
        position, velocity, acceleration: (n, 3) [m, m/s, m/s^2].
        margin: (n,) in ``margin_unit``: ``"N.m"``, or ``"N"`` when it is a force at the CoM.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    margin: FloatArray
    margin_unit: str = "N.m"

    @classmethod
    def of_motion(cls, motion: Motion) -> "ComTrack":
        """Track of a motion, its derivatives by central differences."""
        velocity = com_velocity(motion)
        still = len(motion.time) < 2
        acceleration = np.zeros_like(velocity) if still else np.gradient(velocity, motion.time, axis=0)
        return cls(motion.time, motion.com, velocity, acceleration, motion.margin, motion.margin_unit)

    def at(self, times: FloatArray) -> FloatArray:
        """(n, 3) position at other times [m]; held before the first and after the last."""
        return np.column_stack([np.interp(times, self.time, column) for column in self.position.T])


@dataclass(frozen=True, eq=False, repr=False)
class RunRecord(Displayed):
    """Everything that is known of a run; what it does not have is None or empty.

    Attributes:
        label: What to call the run in figures.
        content: Motions, body, scene and schedule with the real soles.
        mass: Of the body [kg].
        plan: The CoM as planned for a point mass, its margin with the planning soles.
        walks: (n, 4) instants [s], x, y [m] and headings [rad] of ways over the floor, by who walks.
    """

    label: str
    content: MotionFile
    summary: Mapping[str, Any] = field(default_factory=dict)
    mass: float | None = None
    plan: ComTrack | None = None
    walks: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return str(self.summary.get("scenario", self.label))

    @property
    def body(self) -> BodyModel | None:
        """Body that moved."""
        return self.content.body

    @property
    def scene(self) -> Scene | None:
        """Obstacles and floor."""
        return self.content.scene

    @property
    def schedule(self) -> ContactSchedule | None:
        """Contacts in time."""
        return self.content.schedule

    @property
    def motions(self) -> dict[str, Motion]:
        """Whole-body motions by name, ``"planned"`` before ``"executed"``; a point mass has none."""
        jointed = {name: motion for name, motion in self.content.motions.items() if motion.joint_names}
        return jointed if self.body is None or self.body.joint_names else {}

    @cached_property
    def tracks(self) -> dict[str, ComTrack]:
        """The CoM of each motion; without a whole body, that of the planned point mass."""
        if self.plan is not None and not self.motions:
            return {"planned": self.plan}
        moved = self.motions or self.content.motions
        return {name: ComTrack.of_motion(motion) for name, motion in moved.items()}

    @cached_property
    def phases(self) -> PhaseTable | None:
        """Phases of the schedule, or else of the first motion."""
        if self.schedule is None:
            moved = next(iter(self.content.motions.values()), None)
            return None if moved is None else phases_of(moved)
        supports = tuple(tuple(phase.stance.effectors) for phase in self.schedule.sequence)
        return PhaseTable(self.schedule.instants, supports)

    @property
    def effectors(self) -> tuple[str, ...]:
        """Every effector that is ever in contact, in order of first use."""
        phases = () if self.phases is None else self.phases.supports
        return tuple(dict.fromkeys(name for supports in phases for name in supports))

    @cached_property
    def effector_paths(self) -> dict[str, dict[str, FloatArray]]:
        """(n, 3) origin of each effector in contact, by motion and effector [m]; none without a body."""
        if self.body is None or not self.motions:
            return {}
        names = tuple(name for name in self.effectors if name in self.body.effectors)
        return {kind: effector_positions(self.body, motion, names) for kind, motion in self.motions.items()}

    @cached_property
    def zmp(self) -> dict[str, ZmpPath]:
        """The ZMP of each motion; without any, of the planned point mass."""
        if self.schedule is None:
            return {}
        if not self.motions and self.plan is not None and self.mass is not None:
            wrench = pseudo_wrench(self.mass, self.plan.position, self.plan.acceleration)
            return {"planned": zmp_path(self.schedule, self.plan.time, wrench)}
        return {
            name: zmp_path(self.schedule, motion.time, contact_wrench(motion, self.schedule))
            for name, motion in self.motions.items()
        }


def read_run(directory: str | Path) -> RunRecord:
    """Read a run directory written by ``manikin run``, also of a run that stopped early.

    Raises:
        InputError: If it is missing, is not a run directory, or one of its files is damaged.
    """
    folder = Path(directory)
    _check_is_run(folder)
    summary = read_summary(folder)
    has_motion = (folder / MOTION).is_file()
    content = read_motions(folder / MOTION) if has_motion else MotionFile()
    planned, label = folder / STAGES / COM_TRAJECTORY, folder.resolve().name
    if not planned.is_file():
        mass = None if content.body is None else content.body.mass
        return RunRecord(label, content, summary, mass, walks=_read_walks(folder))
    scenario, data = load_scenario(folder / SCENARIO), read_json(planned)
    sequence = scenario.build_sequence(planning=True)
    with _undamaged(planned):
        stances = _first_phases(sequence, len(data["key_instants_s"]) - 1)
        trajectory = CentroidalTrajectory.from_dict(data, stances)
    if not has_motion:
        real = _first_phases(scenario.build_sequence(), len(trajectory.schedule.sequence))
        schedule = ContactSchedule(real, trajectory.schedule.instants)
        content = MotionFile(scene=scenario.build_scene(), schedule=schedule)
    problem = scenario.build_centroidal_problem()
    polytopes = polytopes_of(problem)[: len(trajectory.schedule.sequence)]
    plan = point_mass_track(problem, trajectory, polytopes)
    return RunRecord(label, content, summary, trajectory.mass, plan, _read_walks(folder))


def point_mass_track(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> ComTrack:
    """The planned CoM every millisecond, with its margin by the polytopes of the wrenches of each phase."""
    time = np.concatenate(phase_times(trajectory))
    derivatives = trajectory.position(time), trajectory.velocity(time), trajectory.acceleration(time)
    margin = np.concatenate(phase_margins(problem, trajectory, polytopes))
    return ComTrack(time, *derivatives, margin, problem.margin_unit)


def _check_is_run(folder: Path) -> None:
    valid = "valid: a directory written by manikin run"
    if not folder.is_dir():
        problem = "is a file" if folder.exists() else "there is no such directory"
        raise MotionFileError(f"{folder}: {problem}; {valid}")
    if not (folder / SCENARIO).is_file():
        raise MotionFileError(f"{folder}: is not a run directory, it has no {SCENARIO}; {valid}")
    if not (folder / SUMMARY).is_file():
        raise MotionFileError(f"{folder}: has no {SUMMARY}, its run did not finish; {valid} to its end")


def _read_walks(folder: Path) -> dict[str, FloatArray]:
    """Routes over the floor, (n, 4) each; empty without a walk."""
    path = folder / STAGES / f"{WALK_PATHS}.json"
    with _undamaged(path):
        return {
            name: np.column_stack([item["time_s"], np.reshape(item["place"], (-1, 3))]).astype(np.float64)
            for name, item in (read_json(path) if path.is_file() else {}).items()
        }


@contextmanager
def _undamaged(path: Path) -> Iterator[None]:
    """Context in which values that do not fit become the message that ``path`` is damaged."""
    try:
        yield
    except MotionFileError:
        raise
    except (InputError, KeyError, TypeError, ValueError) as error:
        problem = " ".join(str(error).split())[:160]
        raise MotionFileError(f"{path}: is damaged ({problem}); valid: as written by manikin") from None


def _first_phases(sequence: StanceSequence, count: int) -> StanceSequence:
    """The planned CoM may end before the last phases, which then rest on something else."""
    return sequence if count == len(sequence) else StanceSequence(sequence.phases[:count])


SCENARIO = "scenario.yaml"
CONTACT_PLAN = "contacts.json"
ADAPTATION = "adaptation.json"
"""What has changed from a recording in its adaptation."""
MOTION = "motion.h5"
BVH = "motion.bvh"
OTHERS = "motion-*.h5"
WALK_PATHS = "walk_paths"
"""Stage result with the routes over the floor, by the name of the walker."""
BODY = "the body"
"""Name of the scenario's body in it."""
SUMMARY = "summary.json"
REPORT = "report.html"
STAGES = "stages"


def other_motion(name: str) -> str:
    """File of the motion of another walker."""
    return OTHERS.replace("*", name)


def other_motions(directory: Path) -> dict[str, Path]:
    """Files of the motions of others in a run directory, by their names; none beside a single file."""
    first, last = OTHERS.split("*")
    return {path.name.removeprefix(first).removesuffix(last): path for path in sorted(directory.glob(OTHERS))}


class RunDirectory(ResultDirectory):
    """Writes the files of one run; those of an earlier run are removed first."""

    kind, marks = "run", (SCENARIO,)

    def __init__(self, path: str | Path) -> None:
        """Create the directory, or take over that of an earlier run and remove its files.

        Raises:
            MotionFileError: If it cannot be created, or holds something that is not a run.
        """
        super().__init__(path)
        # The summary goes first: without it the directory is known to be incomplete.
        old = (
            SUMMARY,
            CONTACT_PLAN,
            ADAPTATION,
            MOTION,
            BVH,
            REPORT,
            f"{STAGES}/*.json",
            f"{FIGURES}/*.png",
            OTHERS,
        )
        self.remove(*old)


def read_summary(path: str | Path) -> dict[str, Any]:
    """Summary of a run directory.

    Raises:
        MotionFileError: If there is none, or it is damaged.
    """
    return read_json(Path(path) / SUMMARY, "the directory of a finished run")
