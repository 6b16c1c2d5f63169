"""Measure the motion library that comes with the package: writes ``walking-library.md``.

Run ``python docs/walking_library.py``; it needs no recordings. Times are those of the machine it runs on.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

from manikin.numerics.signals import fourier_basis
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures.views import ALONG_X, ALONG_Y, draw_body
from manikin.walking import walking_path
from manikin.walking.gait.blend import TURN_RADIUS, ControlSpace, Gait, travelled
from manikin.walking.gait.follow_path import WalkController, stance_slides, walk_along
from manikin.walking.gait.library_build import NEAR, NOT_CLOSED
from manikin.walking.gait.motion_library import MIRRORED, ROOT, load_library, reference_body
from manikin.walking.gait.stance_foot import Legs, put_in_place

PAGE = Path(__file__).with_name("walking-library.md")
LIBRARY, BODY = load_library(), reference_body()
GAIT, LEGS, SPACE = Gait(LIBRARY, BODY), Legs(BODY), ControlSpace(LIBRARY)
PHASE = np.arange(64) / 64
GOALS = (
    (4.0, 0.0, 0.0),
    (3.0, 3.0, np.pi / 2),
    (5.0, 0.0, np.pi),
    (0.0, 1.0, 0.0),
    (-2.0, 0.0, 0.0),
    (0.5, 0.0, 0.0),
)
DRAWN = {
    "0.5 m/s": (0.5, 0.0, 0.0), "1.2 m/s": (1.2, 0.0, 0.0), "1 m/s, 0.8 rad/s": (1.0, 0.0, 0.8),
    "0.4 m/s to the left": (0.0, 0.4, 0.0), "1.5 rad/s on the spot": (0.0, 0.0, 1.5),
    "0.7 m/s backward": (-0.7, 0.0, 0.0), "3 m/s": (3.0, 0.0, 0.0),
}  # fmt: skip
ORDERS = (
    ((1.2, 0.0, 0.0), 4.0), ((1.0, 0.0, 0.6), 3.0), ((0.0, 0.4, 0.0), 4.0), ((0.0, 0.0, 1.2), 3.0),
    ((-0.6, 0.0, 0.0), 4.0), ((3.0, 0.0, 0.0), 4.0), ((0.0, 0.0, 0.0), 4.0),
)  # fmt: skip

TEXT = """# The walking library

Walking cycles of recorded people, by velocity, from which whole-body walks are blended (Truong 2010,
chapter 6). Built by `manikin library build`, measured by `docs/walking_library.py`.

```python
from manikin.walking import WalkController, walk_along, walking_path

walk = walk_along(walking_path((0, 0, 0), (3, 3, 1.57), max_speed=1.4))
walk.q, walk.support, walk.slides               # postures at 60 Hz, standing feet, slide of each stance [m]
frame = WalkController().step(1 / 60, (1.2, 0.0, 0.3))    # forward, left [m/s], angular [rad/s]
frame.q, frame.notice                           # posture; says so where no recorded walk is that fast
```

![Walks of given velocities, one cycle each, seen from the right and from the front](images/walks.png)

## How it is made

- A cycle goes from one left toe-off to the next; of those of a window, the one whose ends differ least is
  taken (at most {closed:.0f}° RMS). Where a foot makes one step only, as in sidesteps, the cycle ends when
  the other foot has landed.
- The line or circle of the root is the one around which its error is periodic and has no mean. Joint angles
  and the error are kept as Fourier series of the cycle's duration T (the thesis prints 2 T), mean and
  {harmonics} harmonics.
- Joint angles are those of the 1.75 m human; places and velocities are scaled with the length of the legs,
  durations are kept.
- Skeletons tell the pelvis' tilt loosely; it is set by the trunk's lean, and hips and lumbar spine make up
  for it. Soles are levelled in the middle of the stance.
- Arms and legs are spread until they touch neither the body nor each other: the reference body is wider than
  some of the recorded people.
- A person's habits (offsets of mean angles that velocity does not explain) are taken out, so that blends of
  two people do not change from one habit to another. The movement around the means stays the person's own.
- Straight walks, runs and standing are averaged with their mirror images; of others the mirror image is
  added. Cycles nearer to another than {near:g} m/s (1 rad/s counts as {radius:g} m/s) are left out.
- Velocities are forward, left and angular. The thesis' first one, the total speed, cannot tell backward from
  forward, and blends of it are not the speed of the blend. Outside the tetrahedra the nearest velocity is
  walked, with a notice.

## Cycles

Velocities are those of the 1.75 m human. {count} cycles, {mirrored} of them mirror images.

"""
LEAVE = """
## Leaving one out

Each cycle inside the hull, blended from the others at its velocity: root mean square over all hinges and the
cycle. *Recording out*: its mirror image and others of the same file are left out, too. The offsets of
persons were found with the cycle. {over} At its own velocity every cycle comes back within {own:.1g}°.

"""
SLIDE = """
## Standing feet

Slide in a stance over four cycles at each cycle's velocity: displacements of the lower end of the sole, added
up from frame to frame. Before: as blended. After: feet in place, legs by inverse kinematics. *Sinks*: by how
much the pelvis is lowered for a leg to reach its foot. *Velocity*: largest deviation of the pelvis' velocity
over a cycle from the one asked for.

"""
REST = """
A standing foot does more than roll from heel to ball where joints end: it tips over its edge, and in the
sharpest turns it turns about its heel or ball.

Walks along planned paths, at most 1.4 m/s, 60 frames a second:

"""
DRIVEN = """
Under directives that change at once (forward, sideways, turning, backward, running, standing), with
accelerations of at most 2 m/s², 1.5 m/s² to the side and 4 rad/s²: {stances} stances, slide at most
{slide:.1f} mm.

## Computing time

Processor time on one core. A step of the controller takes {median:.2f} ms in the median and {high:.2f} ms in
the 99th percentile (60 frames/s leave 16.7 ms). A walk along a path takes {metre:.1f} ms per metre in the
median of the walks above, without the path itself (thesis, on its computer: 90 ms).

## Limits

- Sidesteps come from few single steps; walks ahead and aside are blends of sidesteps and walks, for which
  there is no recording. Sharp turns are parts of turns to another direction, not of steady circles.
- There are no walks between standing and {slowest:.2f} m/s: slower ones are blends with standing.
- Without dynamics: the motion has neither forces nor torques, and in quick changes of direction the feet
  stay where they are at the cost of the pelvis, which sinks.

## Acknowledgements

{thanks}
"""


@dataclass(frozen=True, eq=False)
class Steady:
    """Four cycles of a steady walk, measured."""

    q: FloatArray
    before: FloatArray
    after: FloatArray
    sink: float
    error: float


def steady(velocity: FloatArray) -> Steady:
    """Four cycles at a velocity."""
    period = float(GAIT.period(GAIT.blend(velocity[None]))[0])
    count = round(60.0 * period)
    times = np.arange(4 * count + 1) * period / count
    blend = GAIT.blend(np.tile(velocity, (len(times), 1)))
    frames = GAIT.frames(blend, times / period, travelled(blend.velocity, times))
    swing = frames.swing()
    q, sink = LEGS.reached(frames, put_in_place(LEGS.feet(frames), swing))
    turn = travelled(velocity, np.array(period))
    cos, sin = np.cos(turn[2]), np.sin(turn[2])
    places = q[count::count, :2]
    expected = turn[:2] + q[0, :2] @ np.array([[cos, sin], [-sin, cos]])
    error = float(np.hypot(*(places[0] - expected))) / period
    before, after = (stance_slides(BODY, posture, swing < 0.0) for posture in (frames.q, q))
    # The first and the last stance are cut by the begin and the end.
    return Steady(q, before, after, float(sink[count:-count].max()), error)


def rms(first: FloatArray, second: FloatArray) -> float:
    """Over the hinges and a cycle [deg]."""
    difference = (fourier_basis(PHASE) @ (first - second))[:, len(ROOT) :]
    return float(np.degrees(np.sqrt(np.mean(difference**2))))


def left_out(cycle: int, *, recording: bool) -> float | None:
    """RMS of a cycle against the blend of the others [deg]; None if they do not reach it."""
    file = LIBRARY.names[cycle].split(" ")[0]
    others = [
        i
        for i, name in enumerate(LIBRARY.names)
        if i != cycle and not (recording and name.split(" ")[0] == file)
    ]
    rest = LIBRARY.chosen(others)
    blend = ControlSpace(rest).blend(LIBRARY.velocities[[cycle]])
    if blend.outside[0]:
        return None
    mixed = np.tensordot(blend.weights[0], rest.coefficients[blend.cycles[0]], axes=1)
    return rms(mixed, LIBRARY.coefficients[cycle])


def kinds() -> dict[str, list[int]]:
    """Cycles by class, in order."""
    return {
        kind: [i for i, k in enumerate(LIBRARY.kinds) if k == kind] for kind in dict.fromkeys(LIBRARY.kinds)
    }


def cycles_table() -> Iterator[str]:
    """Cycles and velocities by class."""
    yield from row(
        "class", "cycles", "mirror images", "forward [m/s]", "left [m/s]", "angular [rad/s]", "T [s]"
    )
    for kind, members in sorted(kinds().items()):
        images = sum(LIBRARY.names[i].endswith(MIRRORED) for i in members)
        ranges = [span(LIBRARY.velocities[members, axis]) for axis in range(3)]
        yield from row(kind, len(members), images, *ranges, span(LIBRARY.periods[members]), head=False)


def leave_table(alone: dict[int, float], files: dict[int, float]) -> Iterator[str]:
    """RMS by class."""
    yield from row("class", "inside", "median [°]", "largest [°]", "recording out, median [°]")
    groups = [(kind, members) for kind, members in sorted(kinds().items())]
    groups.append(("**all**", list(range(len(LIBRARY)))))
    for kind, members in groups:
        one, other = ([found[i] for i in members if i in found] for found in (alone, files))
        if one:
            without = f"{np.median(other):.1f}" if other else "-"
            yield from row(kind, len(one), f"{np.median(one):.1f}", f"{max(one):.1f}", without, head=False)


def slide_table() -> Iterator[str]:
    """Slides by class."""
    yield from row(
        "class", "stances", "before, median [mm]", "before, largest [mm]", "after, median [mm]",
        "after, largest [mm]", "sinks [mm]", "velocity [mm/s]",
    )  # fmt: skip
    for kind, members in sorted(kinds().items()):
        found = [steady(LIBRARY.velocities[i]) for i in members]
        before, after = (1e3 * np.concatenate([getattr(f, n) for f in found]) for n in ("before", "after"))
        yield from row(
            kind, len(after), f"{np.median(before):.0f}", f"{before.max():.0f}", f"{np.median(after):.1f}",
            f"{after.max():.1f}", f"{1e3 * max(f.sink for f in found):.0f}",
            f"{1e3 * max(f.error for f in found):.2f}", head=False,
        )  # fmt: skip


def walks_table() -> tuple[list[str], float]:
    """Walks along paths, and the median time per metre [ms]."""
    lines = list(row("to x, y [m], heading [°]", "length [m]", "stances", "before, median [mm]",
                     "before, largest [mm]", "after, largest [mm]", "ms per metre"))  # fmt: skip
    costs = []
    for goal in GOALS:
        path = walking_path((0.0, 0.0, 0.0), goal, max_speed=1.4)
        costs.append(1e3 * processor_time(lambda path=path: walk_along(path)) / path.length)
        walk = walk_along(path)
        name = f"{goal[0]:g}, {goal[1]:g}, {np.degrees(goal[2]):.0f}"
        lines += row(
            name, f"{path.length:.1f}", len(walk.slides), f"{1e3 * np.median(walk.slides_before):.0f}",
            f"{1e3 * walk.slides_before.max():.0f}", f"{1e3 * walk.slides.max():.1f}", f"{costs[-1]:.1f}",
            head=False,
        )  # fmt: skip
    return lines, float(np.median(costs))


def driven() -> tuple[FloatArray, FloatArray]:
    """Slides [m] and times of the steps [ms] under changing directives."""
    controller, q, support, times = WalkController(), [], [], []
    for order, duration in ORDERS:
        for _ in range(round(60.0 * duration)):
            begin = time.process_time()
            frame = controller.step(1.0 / 60.0, order)
            times.append(1e3 * (time.process_time() - begin))
            q.append(frame.q)
            support.append(frame.support)
    return stance_slides(BODY, np.array(q), np.array(support).T), np.array(times)


def draw() -> None:
    """One cycle of some walks, from the right and from the front."""
    figure, panels = plt.subplots(len(DRAWN), 1, figsize=(12.0, 1.65 * len(DRAWN)), layout="constrained")
    count = 8
    for axes, (name, velocity) in zip(panels, DRAWN.items(), strict=True):
        q = steady(np.array(velocity)).q
        cycle = q[(len(q) - 1) // 4 : (len(q) - 1) // 2]
        for number, index in enumerate(np.linspace(0, len(cycle) - 1, count).round().astype(int)):
            posture = cycle[index].copy()
            turn = Rotation.from_quat(posture[3:7])
            posture[3:7] = (Rotation.from_euler("Z", -turn.as_euler("ZYX")[0]) * turn).as_quat()
            posture[:2] = 0.0
            draw_body(axes, BODY, posture, ALONG_Y.moved(1.2 * number, 0.0))
            draw_body(axes, BODY, posture, ALONG_X.moved(1.2 * (count + 0.8 * number), 0.0))
        axes.axhline(0.0, color="black", linewidth=0.5)
        axes.set(xlim=(-0.7, 1.2 * 1.8 * count), ylim=(-0.12, 1.85), aspect="equal")
        axes.set_title(name, loc="left", fontsize=9)
        axes.axis("off")
    figure.savefig(PAGE.parent / "images" / "walks.png", dpi=60)
    plt.close(figure)


def processor_time(job: Callable[[], object], rounds: int = 5) -> float:
    """Median over rounds [s]."""
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        job()
        found.append(time.process_time() - begin)
    return float(np.median(found))


def span(values: FloatArray) -> str:
    """Smallest and largest."""
    low, high = (f"{value:.2f}".replace("-0.00", "0.00") for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def row(*cells: object, head: bool = True) -> Iterator[str]:
    """Lines of a Markdown table: a row, and the rule below a head."""
    yield "| " + " | ".join(str(cell) for cell in cells) + " |"
    if head:
        yield "|" + "---|" * len(cells)


def table(lines: Iterator[str] | list[str]) -> str:
    """As text."""
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure everything and write the page."""
    inside = [int(i) for i in np.flatnonzero(~SPACE.on_hull)]
    alone, files = (
        {i: found for i in inside if (found := left_out(i, recording=recording)) is not None}
        for recording in (False, True)
    )
    blend = GAIT.blend(LIBRARY.velocities)
    mixed = np.einsum("nk,nkcs->ncs", blend.weights, LIBRARY.coefficients[blend.cycles])
    own = max(rms(a, b) for a, b in zip(mixed, LIBRARY.coefficients, strict=True))
    walks, metre = walks_table()
    slides, times = driven()
    above = sum(value > 8.0 for value in alone.values())
    numbers = {
        "closed": np.degrees(NOT_CLOSED), "harmonics": LIBRARY.harmonics, "near": NEAR, "radius": TURN_RADIUS,
        "count": len(LIBRARY), "mirrored": sum(name.endswith(MIRRORED) for name in LIBRARY.names),
        "own": max(own, 1e-6), "over": f"{above} of {len(alone)} are above 8°.", "stances": len(slides),
        "slide": 1e3 * slides.max(), "metre": metre, "median": np.median(times),
        "high": np.percentile(times, 99), "thanks": "\n".join(LIBRARY.acknowledgements),
        "slowest": LIBRARY.velocities[kinds()["walk straight"], 0].min(),
    }  # fmt: skip
    PAGE.write_text(
        TEXT.format(**numbers) + table(cycles_table()) + LEAVE.format(**numbers)
        + table(leave_table(alone, files)) + SLIDE + table(slide_table()) + REST + table(walks)
        + DRIVEN.format(**numbers)
    )  # fmt: skip
    draw()


if __name__ == "__main__":
    main()
