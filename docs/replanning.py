"""Re-plan recorded motions and execute them: writes ``replanning.md`` and its figures.

Run ``python docs/replanning.py FOLDER``, with ``--figures`` for the figures alone, where FOLDER holds the
recordings named below: walks over force plates (btk, OpenSim, OpenCap) and motions of the ACCAD Open Motion
Project and the CMU Graphics Lab.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from manikin.analysis.adaptation import Adaptation, adapt_recording, crop
from manikin.motion.file import MotionFile
from manikin.pipeline.run_directory import RunRecord
from manikin.planning.com import KeyframeProblem, plan_com_through_key_frames
from manikin.recordings import Reconstruction, RecordedSupports, read_recording, reconstruct, supports_of
from manikin.reports.analysis_directory import compare_with_recording
from manikin.reports.figures import save_figure
from manikin.reports.figures.compare_runs import (
    compare_planes_figure,
    compare_scene_figure,
    compare_timing_figure,
)
from manikin.reports.figures.scene import draw_moment
from manikin.reports.figures.style import dress, new_grid
from manikin.reports.figures.views import ALONG_X, ALONG_Y

PAGE = Path(__file__).with_suffix(".md")
IMAGES = PAGE.parent / "images"
WALKS = (
    "grf/btkdata/FunctionalWalk.c3d",
    "grf/btkdata/PiG_Motion-FlatFoot-One.c3d",
    "grf/opensim_core/walking2.c3d",
    "grf/opensim_core/walking5.c3d",
    "grf/nimble_opencap_s4/walking1.trc",
)
OTHERS = {
    "cmu_asf_amc/17_03.amc": (True, np.inf),
    "grf/nimble_opencap_s4/STS1.trc": (False, 5.0),
    "accad_male1_bvh/Male1_A5_PickUpBox.bvh": (False, np.inf),
    "accad_male1_bvh/Male1_A2_Sway.bvh": (False, np.inf),
    "accad_male1_bvh/Male1_B22_SideStepLeft.bvh": (True, np.inf),
}
"""A stealthy walk; standing up, sitting down and standing up; a box picked up from low; swaying; a leap to
the side. Whether feet stand on toes, and up to when [s]."""

SHOWN = WALKS[1]
"""The walk of the figures and of the table of phases."""

TEXT = """# Recorded motions re-planned

What people did, on the very stances they did it on, planned by both methods of Qiu (2012, chapter 5) and
executed by our controller in the physics engine. By `docs/replanning.py`; in Python:

```text
from manikin.analysis.adaptation import adapt_recording
from manikin.reports.analysis_directory import compare_with_recording
result = adapt_recording(found, supports, method="keyframes", execute=True)  # of manikin.recordings
result.as_dict(), result.planned, result.executed, result.schedule
compare_with_recording(result).as_dict()                             # timing, centre of mass, margins
```

## The key frame method (5.3)

The thesis passes the recorded CoM exactly at every change of support and adds recorded positions as key
frames where balance is lost in between. *Exact* says what that comes to on each walk, whole soles, margin ≥
0 all along. A walk's double supports last a tenth of a second: a centimetre of error in a CoM that is fixed
there needs accelerations that no foot can give, and a further fixed position makes it worse. So
`plan_com_near_key_frames` lets the key frames pull, imposes balance every 10 ms (the wrench, bilinear,
linearised about the last solution), measures it every millisecond, and adds the sample that is farthest off
as one more key frame where the plan strays by more than 1 cm. Feet stand on their whole soles, or on their
toes once the heel has lifted.

A walker is no point mass: a plan without angular momentum leaves it to the arms to cancel that of the legs.
So a plan takes over the rate of the recorded postures' angular momentum (4.51), changed as little as balance
asks for. The postures fitted to that plan and to the exact contacts give way between both; their own rate is
what a second plan, the one that counts, is made with. The
margin, about the world origin, is the lesser one of the point mass and of the body that turns; the latter is
asked for with 8 N.m to spare, and 20 N.m more are wished for and paid for where they lack: a plan on the
edge of the soles leaves a controller nothing to come back with. Several things adapt the recorded contacts
to a body with stiff segments: a heel lands with the whole sole; a foot leaves once the hinge of its toes has
moved by 2 cm, at most 0.1 s early (it rolls over the tips, which ours cannot); a seat is left once the
buttocks are 1.5 cm above it, as flesh and cushion follow and a block does not; what a clip's end cuts of a
foot's part to less than 80 ms is as beside; and soles end where a load of 1.4 body weights, which is also
the most that a foot on its toes carries, asks for the strength of the toes.

"""
EXECUTED = """
## Executed

The recorded postures are adapted to that CoM, its angular momentum and the exact stances in one smooth fit
(postures and accelerations near the recorded ones, feet, CoM, distances, strength), and the controller
executes the result at the recorded speed from the first frame to the last, or one step before it where it
would be stopped dead. *Posture*: root mean square deviation of all hinges from the recording, without the
toes, which no marker shows. *Torque*: largest share of a joint's strength in the plan. *Balanced*: share of
the control steps with a positive margin of the measured contact forces. CoM and feet: errors from the plan.
The figures are from before plans minded the strength and began from the recorded angular momentum
([adapted recordings](adaptation.md) tell what changed), and were not measured again since.

"""
NOTES = """
All five walks come to the end with nothing in touch but soles and floor; planned distances are 2 cm and
more. Postures were 12 to 15° off, for four reasons, found one by one: accelerations cost by themselves and
not by their difference from the recorded ones; feet tilted on their toes by at most 35° where people reach
50 to 70°, which held the leg back at push-off (knees 40°, shoulders 60° off there, and hardly anything in
between); the arms made up for the angular momentum that a point mass leaves out; recorded soles and shanks,
narrower than the body's, pass within each other by up to 3 cm, so that a flying foot now gives way to the
side. Toes were the joints beyond their strength (up to 1.9), with the centre of pressure at their tips.

Then four more. `17_03`, a stealthy walk, nearly fell: a foot that turns on its toes while it carries was
taken for one that rolls over their tips, so that double supports of three quarters of a second shrank to a
twentieth, and the CoM was on the edge of one sole for the rest (CoM 143 mm off; key frames 33, now 17).
`PiG_Motion-FlatFoot-One` asked for 1.8 of the strength where the clip ends: a foot about to land was lifted
by 3 cm all the same, and the other one rose onto its toes in the 50 ms left. Buttocks that stayed on a seat
while the cushion of the recorded one still rose, and then joined the recorded path over 0.8 s, made the
arms of `STS1` swing up by 150°; its least margin of -127 N.m was that of a body stopped dead after the last
instant. And feet left their contacts by 3 to 5 mm in the last hundredth of a second, as their flight began
a sample too early. The planned whole body's margin is positive for 96 to 100 % of the time (82 to 95 % with
the rate of the angular momentum of the first fit, and no wish for more than the least margin), contacts are
met within 1.4 mm.

What is left: ankles and knees while a sole lands flat where the recorded heel rolls down for some 60 ms (up
to 27° and 36°), and shoulders, by up to 46° at instants, most of them beside those landings; the trunk of
`STS1`, as the pelvis lies level on a seat where the recorded one is tilted back by 20 to 34°, and its arms,
by up to 100° where it sits down, though no joint is beyond its strength; toe, ankle and a shoulder of
`FunctionalWalk` beyond it at instants. A heel that touches one step before its time makes the least margin
of `walking5`, for 5 ms. `STS1` is its first five seconds: rise, sit down, rise; a seat is rigid and at one
place.

Tried and left out: the recording moved by the least shift that its contacts can carry
(`manikin.recordings.least_shift`) as the reference of CoM and postures. On `walking1`, `walking2`, `walking5`
and `PiG_Motion-FlatFoot-One` it takes 2, 7, 9 and 4 added key frames instead of 2, 8, 8 and 5, ends 5.5,
8.2, 7.6 and 5.5 mm from the recorded CoM instead of 5.3, 7.6, 6.7 and 4.8, and changes neither the share of
positive margins nor support errors by more than a hundredth and a tenth of a millimetre. A third plan with
the angular momentum of a third fit changes as little.

Not solved: without double support between two single ones, as in the leap of `SideStepLeft`, there is no
plan. Timing-free plans have no angular momentum of their own: a walk on whole soles (`walking1`) falls
after about a second.

"""
AGAINST = """
## Plan against recording (7.3)

The same stances on whole soles, timing-free: durations between half and twice the recorded ones, position
and velocity of both ends as recorded, the CoM no farther from a foot than it was recorded, and within 10 cm
of the recorded heights. CoM: root mean square distance at equal shares of each phase. *Recorded* margin:
that of a point mass with the recorded
acceleration, which a recording with noise need not keep.

"""
PHASES = """
As in the thesis (Table 7.7, Fig. 7.16), small polytopes make short phases: double supports last up to their
longest and the plan takes longer than the person did. Single supports are cut up to 1.3 m/s, at 1.6 m/s they
are not. Phases of `{name}`:

"""
FIGURES = """
![CoM of recording and plan](images/replanning-planes.png)

![CoM of recording and plan in space](images/replanning-scene.png)

![Timing of recording and plan](images/replanning-timing.png)
"""


def read(path: Path) -> tuple[Reconstruction, RecordedSupports]:
    """Postures and supports of a recording."""
    found = reconstruct(read_recording(path))
    return found, supports_of(found)


def exact(plan: Adaptation) -> str:
    """What becomes of the method that passes every key frame."""
    com = plan.recorded.com
    velocity = np.gradient(com, plan.recorded.time, axis=0, edge_order=2)
    asked = KeyframeProblem(
        plan.body.mass, plan.recording, start_velocity=velocity[0], goal_velocity=velocity[-1]
    )
    found = plan_com_through_key_frames(asked)
    if found.trajectory is None:
        return "none at the key frames" if found.certificate is None else "lost between them"
    away = np.linalg.norm(found.trajectory.position(plan.recording.time) - plan.recording.com, axis=1)
    return f"{1e3 * np.sqrt(np.mean(away**2)):.1f} mm"


def row(*cells: object) -> str:
    """A row of a table."""
    return "| " + " | ".join(str(cell) for cell in cells) + " |\n"


def head(*cells: str) -> str:
    """The head of a table whose first column is text."""
    return row(*cells) + row("---", *["--:"] * (len(cells) - 1))


def near_row(name: str, whole: Adaptation, rolling: Adaptation) -> str:
    """Numbers of the key frame method on one walk."""
    made = rolling.as_dict()
    return row(
        f"`{name}`", f"{made['recorded_duration_s']:.2f}", exact(whole), made["key_frames"],
        made["added_key_frames"], f"{1e3 * whole.as_dict()['com_rms_m']:.1f}",
        f"{1e3 * made['com_rms_m']:.1f}", f"{1e3 * made['com_max_m']:.1f}", f"{made['min_margin']:.2f}",
    )  # fmt: skip


def executed_row(name: str, plan: Adaptation) -> str:
    """Numbers of one execution."""
    made = plan.as_dict()
    fit, ran = made["wholebody"], made["execution"]
    if fit is None or ran is None:
        return row(f"`{name}`", made["failure"], *[""] * 8)
    return row(
        f"`{name}`", ran["failure"] or "to the end", f"{ran['executed_s']:.2f}",
        f"{np.degrees(fit['posture_rms_rad']):.1f}", f"{fit['max_torque_share']:.2f}",
        f"{1e3 * ran['com_rms_error_m']:.1f}", f"{1e3 * ran['com_max_error_m']:.1f}",
        f"{1e3 * ran['max_foot_error_m']:.0f}", f"{100.0 * ran['share_positive_margin']:.1f}",
        f"{ran['min_margin']:.1f}",
    )  # fmt: skip


def against_row(name: str, plan: Adaptation) -> str:
    """Numbers of one timing-free plan."""
    made = plan.as_dict()
    if not made["succeeded"]:
        return row(f"`{name}`", f"{made['recorded_duration_s']:.2f}", made["failure"], *[""] * 6)
    counts = np.array([len(held) for held in made["supports"]])
    mine, theirs = np.array(made["phase_durations_s"]), np.array(made["recorded_phase_durations_s"])
    compared = compare_with_recording(plan).as_dict()["margins"]["point_mass"]
    return row(
        f"`{name}`", f"{made['recorded_duration_s']:.2f}", f"{made['duration_s']:.2f}",
        *(f"{values[counts == count].mean():.2f}" for count in (1, 2) for values in (theirs, mine)),
        f"{1e2 * made['com_rms_m']:.1f}", f"{compared['min_first']:.0f}", f"{compared['min_second']:.0f}",
    )  # fmt: skip


def phase_table(plan: Adaptation) -> str:
    """Key instants of recording and plan, as Table 7.7."""
    made = plan.as_dict()
    theirs, mine = plan.recording.key_times, plan.schedule.instants
    lines = [head("feet", "recorded from [s]", "planned from [s]", "recorded [s]", "planned [s]")]
    for index, held in enumerate(made["supports"]):
        feet = " and ".join(name.removesuffix("_foot") for name in held)
        lines.append(row(
            feet, f"{theirs[index]:.2f}", f"{mine[index]:.2f}",
            f"{made['recorded_phase_durations_s'][index]:.2f}", f"{made['phase_durations_s'][index]:.2f}",
        ))  # fmt: skip
    return "".join(lines)


def key_frame_figure(plan: Adaptation) -> Figure:
    """Recorded and planned CoM with the key frames, and both margins (Fig. 5.3 and 5.5)."""
    figure, grid = new_grid(9.0, 9.0, "A recorded centre of mass and the plan near its key frames", 4, 1)
    axes = [figure.add_subplot(grid[number]) for number in range(4)]
    compared = compare_with_recording(plan)
    first, second = compared.first.plan, compared.second.plan
    frames = list(getattr(plan.com, "frames", ()))
    if first is None or second is None:
        return figure
    for axis, panel, name in zip(range(3), axes, "xyz", strict=False):
        panel.plot(first.time, first.position[:, axis], label="recorded", linewidth=2.5, color="0.7")
        panel.plot(second.time, second.position[:, axis], label="planned", linewidth=1.2)
        panel.plot(first.time[frames], first.position[frames, axis], "k*", markersize=5, label="key frames")
        dress(panel, ylabel=f"{name} [m]")
    axes[0].legend(fontsize=8, frameon=False, ncols=3)
    axes[3].plot(first.time, first.margin, linewidth=2.0, color="0.7")
    axes[3].plot(second.time, second.margin, linewidth=1.2)
    axes[3].axhline(0.0, color="k", linewidth=0.6)
    dress(axes[3], ylabel="margin [N.m]", xlabel="time [s]")
    return figure


def posture_figure(plan: Adaptation, count: int = 9) -> Figure:
    """Recorded, planned and executed postures at the same instants, seen from the side."""
    kinds = {"recorded": plan.recorded, "planned": plan.planned, "executed": plan.executed}
    motions = {name: motion for name, motion in kinds.items() if motion is not None}
    record = RunRecord(
        "postures", MotionFile(body=plan.body, scene=plan.scene, schedule=plan.schedule),
        {"succeeded": True}, plan.body.mass, None,
    )  # fmt: skip
    view = ALONG_Y if np.ptp(plan.recorded.com[:, 1]) < np.ptp(plan.recorded.com[:, 0]) else ALONG_X
    reach = np.array([0.65, 0.65, 1.0])
    figure, grid = new_grid(
        14.0, 9.2, "A recorded walk, its plan and its execution", len(motions), 1, between=0.15
    )
    for row, (name, motion) in enumerate(motions.items()):
        axes = figure.add_subplot(grid[row, 0])
        for column, time in enumerate(np.linspace(0.0, 0.999, count) * plan.recorded.time[-1]):
            sample = int(np.argmin(np.abs(motion.time - time)))
            centre = motion.com[sample]
            across = view(centre[None])[0][0]
            draw_moment(
                axes, record, motion, sample, view.moved(1.15 * column - across, 0.0),
                (centre - reach, centre + reach),
            )  # fmt: skip
            axes.text(1.15 * column, 1.86, f"{time:.2f} s", ha="center", fontsize=8)
        dress(axes, ylabel=name)
        axes.set(xlim=(-0.6, 1.15 * count - 0.5), ylim=(-0.05, 1.95), xticks=[])
        axes.set_aspect("equal")
    return figure


def adapted(found: Reconstruction, supports: RecordedSupports) -> dict[str, Adaptation]:
    """A walk re-planned near its key frames, and executed with toes that roll, and free of its timing."""
    return {
        "near": adapt_recording(found, supports, rolling=False),
        "free": adapt_recording(found, supports, method="timing-free", rolling=False),
        "ran": adapt_recording(found, supports, execute=True, rolling=True),
    }


def draw(shown: dict[str, Adaptation]) -> None:
    """Write the figures of the walk that is shown."""
    for name, figure in (
        ("keyframes", key_frame_figure(shown["near"])),
        ("planes", compare_planes_figure(compare_with_recording(shown["free"]))),
        ("scene", compare_scene_figure(compare_with_recording(shown["free"]))),
        ("postures", posture_figure(shown["ran"])),
        ("timing", compare_timing_figure(compare_with_recording(shown["free"]))),
    ):
        save_figure(figure, IMAGES / f"replanning-{name}.png")


def main(folder: Path) -> None:
    """Measure everything and write page and figures."""
    near, ran, against, shown = [], [], [], {}
    for path, (toes, end) in (dict.fromkeys(WALKS, (True, np.inf)) | OTHERS).items():
        found, supports = crop(*read(folder / path), 0.0, end)
        name = Path(path).stem
        print(name, file=sys.stderr)
        if path not in WALKS:
            ran.append(executed_row(name, adapt_recording(found, supports, execute=True, rolling=toes)))
            continue
        walk = adapted(found, supports)
        ran.append(executed_row(name, walk["ran"]))
        near.append(near_row(name, walk["near"], walk["ran"]))
        against.append(against_row(name, walk["free"]))
        shown = walk if path == SHOWN else shown
    draw(shown)
    PAGE.write_text(
        TEXT
        + head("walk", "duration [s]", "exact", "key frames", "of them added", "RMS, whole soles [mm]",
               "RMS, with toes [mm]", "largest [mm]", "least margin [N.m]")
        + "".join(near) + "\n![Key frames](images/replanning-keyframes.png)\n" + EXECUTED
        + head("recording", "outcome", "executed [s]", "posture [°]", "torque", "CoM RMS [mm]",
               "CoM largest [mm]", "feet largest [mm]", "balanced [%]", "least margin [N.m]")
        + "".join(ran) + "\n![Postures](images/replanning-postures.png)\n" + NOTES + AGAINST.lstrip("\n")
        + head("walk", "recorded [s]", "planned [s]", "single, recorded [s]", "single, planned [s]",
               "double, recorded [s]", "double, planned [s]", "CoM RMS [cm]", "least margin, recorded [N.m]",
               "least margin, planned [N.m]")
        + "".join(against) + PHASES.format(name=Path(SHOWN).stem) + phase_table(shown["free"]) + FIGURES,
        encoding="utf-8",
    )  # fmt: skip


if __name__ == "__main__":
    if "--figures" in sys.argv:
        draw(adapted(*crop(*read(Path(sys.argv[1]) / SHOWN), 0.0, np.inf)))
    else:
        main(Path(sys.argv[1]))
