"""A motion in its scene: bodies along the path of the centre of mass, and postures side by side."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.motion import phases_of, segment_positions
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.figures import style, views
from manikin.reports.figures.space import Space
from manikin.reports.taken_objects import scene_at
from manikin.runtime.display import COLOURS, colours_of, side_colour

MOST = 9
"""Largest number of key instants drawn; of more some are left out, evenly."""
GAP = 0.12
"""Gap between two panels [m]."""

Corners = tuple[FloatArray, FloatArray]


def postures_figure(record: RunRecord) -> Figure:
    """Draw the body at the key instants, seen along y and along x ([Qiu2012]_ Fig. 5.14, 6.8, 7.10, 7.13).

    A motion in one stance has no key instants; it is drawn where much happens. The executed motion is drawn,
    or else the planned one; grey, the path of the CoM.
    """
    motions = style.need(record.motions, "a whole-body motion")
    style.need(record.body, "a body")
    phases = style.need(record.phases, "phases")
    name, motion = list(motions.items())[-1]
    instants = chosen_instants(phases.instants)
    if len(instants) == 2:
        instants = eventful_instants(motion)
    samples = [int(np.argmin(np.abs(motion.time - instant))) for instant in instants]
    words = [f"{instant:.2f} s" for instant in instants]
    low, high = _frame(record, motion.com)
    return _panels(record, motion, samples, words, f"Postures at the key instants ({name})", (low, high))


def operations_figure(record: RunRecord) -> Figure:
    """Draw the body at the end of each operation, with what was taken up where it is then."""
    operations = style.need((record.summary.get("operations") or {}).get("list"), "operations")
    motions = style.need(record.motions, "a whole-body motion")
    name, motion = list(motions.items())[-1]
    samples = [int(np.argmin(np.abs(motion.time - item["end_s"]))) for item in operations]
    low, high = _frame(record, motion.com)
    for place in (there["position"] for item in operations for there in item["objects"]):
        low, high = np.minimum(low, np.array(place) - AROUND), np.maximum(high, np.array(place) + AROUND)
    words = [f"{item['operation']}, {item['end_s']:.1f} s" for item in operations]
    title = f"Postures at the ends of the operations ({name})"
    return _panels(record, motion, samples, words, title, (low, high), least_scale=1.0)


def _panels(
    record: RunRecord, motion: Motion, samples: Sequence[int], words: Sequence[str], title: str, box: Corners,
    least_scale: float = 0.0,
) -> Figure:  # fmt: skip
    """The body at samples of a motion, with words above each, seen along y and along x."""
    low, high = box
    spans, widest = high - low, float((high - low)[:2].max())
    scale = max(least_scale, 1.85 / widest)
    figure, grid = style.new_grid(
        (widest + GAP) * scale * len(samples) + 0.75, 2.0 * spans[2] * scale + 1.7, title, 2, 1,
        top=0.65, between=0.5,
    )  # fmt: skip
    for row, view in enumerate((views.ALONG_Y, views.ALONG_X)):
        axes = figure.add_subplot(grid[row, 0])
        left, right = view(np.array([low, high]))[:, 0]
        offsets = [(widest + GAP) * column for column in range(len(samples))]
        for offset, sample, text in zip(offsets, samples, words, strict=True):
            _draw_posture(axes, record, motion, sample, view.moved(offset, 0.0), box)
            if row == 0:
                style.note(axes, text, (offset + (left + right) / 2, high[2]), 4, fontsize=9)
        horizontal, vertical = view.labels
        style.dress(axes, vertical, f"{horizontal}, seen {view.words}, each panel")
        frame_panels(axes, (left, right), (low[2], high[2]), offsets)
    return figure


def _draw_posture(
    axes: Axes, record: RunRecord, motion: Motion, sample: int, view: views.View, box: Corners
) -> None:
    draw_moment(axes, record, motion, sample, view, box)
    if record.schedule is not None:
        end = float(record.schedule.instants[-1])
        for contact in record.schedule.stance_at(min(float(motion.time[sample]), end)):
            views.draw_contact(axes, contact, view, side_colour(contact.effector))
    axes.plot(*view(motion.com).T, color=COLOURS["soft"], linewidth=0.8, zorder=4)


def draw_moment(
    axes: Axes, record: RunRecord, motion: Motion, sample: int, view: views.View, box: Corners
) -> None:
    """Draw the body among the obstacles in a box [m] at one sample of a motion, with its CoM."""
    if record.body is not None:
        views.draw_body(axes, scene_at(record, motion, sample), record.body, motion.q[sample], view, box)
    axes.plot(*view(motion.com[sample]), "o", color=COLOURS["ink"], markersize=4, zorder=5)


def frame_panels(
    axes: Axes, across: tuple[float, float], upwards: tuple[float, float], offsets: Sequence[float]
) -> None:
    """Set ticks and limits of panels side by side in one pair of axes, to one scale.

    Args:
        across: Both ends of the first panel [m].
        upwards: Both ends of all of them [m].
        offsets: Where the zero of each panel is drawn [m].
    """
    left, right = across
    axes.grid(False)
    axes.set_xticks(*views.panel_ticks(left, right, offsets))
    axes.set(xlim=(left, right + offsets[-1]), ylim=upwards)
    axes.set_aspect("equal", adjustable="box", anchor="W")


def chosen_instants(instants: FloatArray) -> FloatArray:
    """At most :data:`MOST` of the key instants, the first and the last among them."""
    if len(instants) <= MOST:
        return instants
    return instants[np.unique(np.linspace(0, len(instants) - 1, MOST).round().astype(int))]


def eventful_instants(motion: Motion) -> FloatArray:
    """At most :data:`MOST` instants between which the joints turn equally far, from begin to end [s]."""
    travel = np.abs(np.diff(motion.q[:, 7:], axis=0)).sum(axis=1)
    turned = np.concatenate(([0.0], np.cumsum(travel + 1e-9)))
    return np.interp(np.linspace(0.0, turned[-1], min(MOST, len(turned))), turned, motion.time)


def _frame(record: RunRecord, com: FloatArray) -> Corners:
    """Corners of a box around the body during the whole motion [m]."""
    reach = np.array([0.55, 0.55, 1.05])
    low, high = com.min(axis=0) - reach, com.max(axis=0) + reach
    if record.schedule is not None:
        soles = np.vstack([c.points_in_world for phase in record.schedule.sequence for c in phase.stance])
        low = np.minimum(low, soles.min(axis=0) - 0.05)
        low[2] = min(float(soles[:, 2].min()) - 0.05, float(com[:, 2].min()) - 0.3)
        high = np.maximum(high, soles.max(axis=0) + 0.05)
    return low, high


AROUND = 0.3
"""Room around what is taken up in the figure of operations [m]."""
LEAST_CHANGE = 0.42
"""Bodies in one picture differ at least so much, as the root mean square over the segments [m]."""
MOST_BODIES = 5
"""Largest number of bodies in one picture."""


def scene_figure(record: RunRecord) -> Figure:
    """Draw bodies on their way, the path of the CoM and the supports ([Qiu2012]_ Fig. 5.21, 7.7, 7.8).

    The eye is where most of the bodies is seen. What hides more of one than a little is seen through. Of a
    point mass, the legs in each phase are drawn.
    """
    name, track = list(style.need(record.tracks, "a motion of the centre of mass").items())[-1]
    motion, body = record.motions.get(name), record.body
    schedule, instants, postures = record.schedule, np.zeros(0), np.zeros((0, 0))
    if motion is not None and body is not None and not body.is_point_mass:
        instants, postures = chosen_postures(body, motion, schedule)
    contacts = [] if schedule is None else views.distinct_contacts(schedule)
    space = Space.of(record.scene, [track.position], contacts=contacts, body=body, postures=postures)
    figure, axes = space_figure(space, f"Motion in the scene ({name})")
    if not len(postures) and schedule is not None:
        _draw_legs(axes, space, track, schedule)
    space.draw_points(axes)
    space.plot(axes, track.position, color=COLOURS[name], linewidth=2.0, label="centre of mass", zorder=8)
    if record.phases is not None:
        look = {"color": COLOURS["ink"], "markersize": 4.0, "zorder": 9, "label": "at the key instants"}
        space.plot(axes, track.at(record.phases.instants), "o", **look)
    labels = style.Labels(axes)
    for instant, solid in zip(instants, space.bodies, strict=False):
        top = space.camera.project(solid.vertices[np.argmax(solid.vertices[:, 2])])
        look = {"ha": "center", "color": COLOURS["ink"], "size": 9.0}
        labels.write(f"{instant:.2f} s", (top[0], top[1]), (0.0, 4.0), **look)
    space.name_obstacles(labels)
    style.legend_in_title(figure, axes)
    return figure


def space_figure(space: Space, title: str, size: float = 9.5) -> tuple[Figure, Axes]:
    """A figure that shows a space in its one pair of axes, so wide or high [inch]."""
    width = size if space.shape <= 1.0 else max(size / space.shape, 0.55 * size)
    figure = style.new_figure(width, width * space.shape + 0.5, title)
    figure.set_layout_engine("none")
    share = width * space.shape / (width * space.shape + 0.5)
    axes = figure.add_axes((0.0, 0.0, 1.0, share))
    space.draw(axes)
    return figure, axes


def chosen_postures(
    body: BodyModel, motion: Motion, schedule: ContactSchedule | None
) -> tuple[FloatArray, FloatArray]:
    """Instants (k,) [s] and postures (k, nq) that differ: the first, the last, the farthest from those."""
    instants = phases_of(motion, schedule).instants
    if len(instants) == 2:
        instants = eventful_instants(motion)
    samples = np.unique([int(np.argmin(np.abs(motion.time - instant))) for instant in instants])
    places = np.array([np.vstack(list(segment_positions(body, motion.q[k]).values())) for k in samples])
    apart = np.sqrt(np.mean(np.sum((places[:, None] - places[None]) ** 2, axis=-1), axis=-1))
    chosen = [len(samples) - 1]
    if apart[0, -1] >= LEAST_CHANGE:
        chosen.append(0)
    while len(chosen) < MOST_BODIES and (away := apart[:, chosen].min(axis=1)).max() >= LEAST_CHANGE:
        chosen.append(int(np.argmax(away)))
    kept = samples[sorted(chosen)]
    return motion.time[kept], motion.q[kept]


def _draw_legs(axes: Axes, space: Space, track: ComTrack, schedule: ContactSchedule) -> None:
    """Join the point mass to the contacts held in the middle of each phase; thick where they are fewer."""
    most = max(len(phase.stance) for phase in schedule.sequence)
    colours = colours_of(schedule.sequence.effectors)
    middles = (schedule.instants[:-1] + schedule.instants[1:]) / 2.0
    for place, phase in zip(track.at(middles), schedule.sequence, strict=True):
        if not len(phase.stance):
            continue
        axes.add_collection(LineCollection(
            [space.camera.project(np.array([place, contact.position])) for contact in phase.stance],
            colors=[colours[contact.effector] for contact in phase.stance],
            linewidths=2.0 if len(phase.stance) < most else 0.8, alpha=0.7, zorder=6,
        ), autolim=False)  # fmt: skip
