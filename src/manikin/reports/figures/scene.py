"""A motion in its scene: path of the centre of mass with stick figures, and postures side by side."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from mpl_toolkits.mplot3d.proj3d import proj_transform

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.motion import phases_of, segment_positions
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.figures import style, views
from manikin.runtime.display import COLOURS, colours_of, side_colour
from manikin.scene import Box, Scene

MOST = 9
"""Largest number of key instants drawn; of more some are left out, evenly."""
GAP = 0.12
"""Gap between two panels [m]."""

Corners = tuple[FloatArray, FloatArray]
Moments = list[tuple[float, dict[str, FloatArray]]]
"""Key instants [s] and the places of the segments at them."""


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
    low, high = _frame(record, motion.com)
    spans = high - low
    widest = spans[:2].max()
    scale = 1.85 / widest
    figure, grid = style.new_grid(
        (widest + GAP) * scale * len(samples) + 0.75, 2.0 * spans[2] * scale + 1.7,
        f"Postures at the key instants ({name})", 2, 1, top=0.65, between=0.5,
    )  # fmt: skip
    for row, view in enumerate((views.ALONG_Y, views.ALONG_X)):
        axes = figure.add_subplot(grid[row, 0])
        left, right = view(np.array([low, high]))[:, 0]
        offsets = [(widest + GAP) * column for column in range(len(samples))]
        for offset, sample, instant in zip(offsets, samples, instants, strict=True):
            _draw_posture(axes, record, motion, sample, view.moved(offset, 0.0), (low, high))
            if row == 0:
                top = offset + (left + right) / 2, high[2]
                style.note(axes, f"{instant:.2f} s", top, 4, fontsize=9)
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
    if record.scene is not None:
        views.draw_obstacles(axes, record.scene, view, *box)
    if record.body is not None:
        views.draw_body(axes, record.body, motion.q[sample], view)
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
    axes.grid(False, axis="x")
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


MOST_TICKS = 9
"""Ticks of the longest axis; the others have fewer."""
_QUADS = np.array([(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)])
"""Faces of a box by the numbers of its corners."""


def scene_figure(record: RunRecord) -> Figure:
    """Draw the CoM's path, the obstacles, the supports and the body ([Qiu2012]_ Fig. 5.21, 7.7, 7.8)."""
    name, track = list(style.need(record.tracks, "a motion of the centre of mass").items())[-1]
    motion = record.motions.get(name)
    figure = style.new_figure(9.5, 8.0, f"Motion in the scene ({name})")
    axes: Axes3D = figure.add_subplot(projection="3d", computed_zorder=False)
    seen = [track.position]
    corners = draw_scene(axes, record.scene)
    if record.schedule is not None:
        seen.append(draw_soles(axes, record.schedule))
    moments: Moments = []
    if motion is not None and record.body is not None and not record.body.is_point_mass:
        moments = _moments(record.body, motion, record.schedule)
        seen.append(_draw_figures(axes, record.body, moments))
    elif record.schedule is not None:
        _draw_legs(axes, track, record.schedule)
    axes.plot(*track.position.T, color=COLOURS[name], linewidth=2.2, label="centre of mass", zorder=8)
    if record.phases is not None:
        places = track.at(record.phases.instants)
        look = {"color": COLOURS["ink"], "zorder": 9, "label": "at the key instants"}
        axes.scatter(*places.T, s=18, depthshade=False, **look)
    frame(axes, np.vstack(seen), corners)
    axes.view_init(14.0, -62.0)
    if moments:
        _label_heads(axes, moments)
    axes.legend(loc="upper right", fontsize=8, frameon=False)
    return figure


def _moments(body: BodyModel, motion: Motion, schedule: ContactSchedule | None) -> Moments:
    instants = phases_of(motion, schedule).instants
    samples = [int(np.argmin(np.abs(motion.time - instant))) for instant in instants]
    postures = [segment_positions(body, motion.q[sample]) for sample in samples]
    return list(zip(instants.tolist(), postures, strict=True))


def _draw_figures(axes: Axes3D, body: BodyModel, moments: Moments) -> FloatArray:
    postures = [places for _, places in moments]
    sticks = _sticks(body)
    sides = [next((s for s in ("left", "right") if s in f"{a} {b}"), None) for a, b in sticks]
    for number, places in enumerate(postures):
        end = number in (0, len(postures) - 1)
        axes.add_collection3d(Line3DCollection(
            [[places[first], places[second]] for first, second in sticks],
            colors=[COLOURS["ink" if side is None else f"{side}_foot"] for side in sides],
            linewidths=2.6 if end else 1.4, alpha=0.95 if end else 0.3 + 0.3 * number / len(postures),
            capstyle="round", zorder=6,
        ))  # fmt: skip
    return np.vstack([list(places.values()) for places in postures])


def _draw_legs(axes: Axes3D, track: ComTrack, schedule: ContactSchedule) -> None:
    """Join the point mass to the contacts held in the middle of each phase; thick where they are fewer."""
    most = max(len(phase.stance) for phase in schedule.sequence)
    colours = colours_of(schedule.sequence.effectors)
    middles = (schedule.instants[:-1] + schedule.instants[1:]) / 2.0
    for place, phase in zip(track.at(middles), schedule.sequence, strict=True):
        if not len(phase.stance):
            continue
        axes.add_collection3d(Line3DCollection(
            [[place, contact.position] for contact in phase.stance],
            colors=[colours[contact.effector] for contact in phase.stance],
            linewidths=2.0 if len(phase.stance) < most else 0.8, alpha=0.7, zorder=6,
        ))  # fmt: skip


def _label_heads(axes: Axes3D, moments: Moments) -> None:
    """Write the time above each head, the ends first, leaving out what would overlap."""
    projection = axes.get_proj()
    taken: list[FloatArray] = []
    for instant, places in [moments[0], *moments[-1:], *moments[1:-1]]:
        head = places.get("effector/head")
        if head is None:
            continue
        seen = np.array(proj_transform(head[0], head[1], head[2], projection)[:2])
        if any(np.all(np.abs(seen - other) < (0.008, 0.005)) for other in taken):
            continue
        taken.append(seen)
        axes.text(
            head[0], head[1], head[2] + 0.05, f"{instant:.2f} s", fontsize=7.5, ha="center",
            color=COLOURS["ink"], zorder=9, path_effects=[style.white_edge()],
        )  # fmt: skip


def _sticks(body: BodyModel) -> list[tuple[str, str]]:
    """Pairs of joints to be joined: every segment with its parent, the hands' and the head's ends."""
    sticks = [(segment.parent, segment.name) for segment in body.segments if segment.parent is not None]
    free = [e for e in body.effectors.values() if "foot" not in e.name and e.segment != body.segments[0].name]
    return sticks + [(effector.segment, f"effector/{effector.name}") for effector in free]


def draw_scene(axes: Axes3D, scene: Scene | None) -> FloatArray:
    """Draw every finite obstacle; return the corners of their bounds."""
    corners = [np.zeros((0, 3))]
    for obstacle in [] if scene is None else views.finite_obstacles(scene):
        if isinstance(obstacle.shape, Box):
            faces = obstacle.to_world(views.BOX_CORNERS * obstacle.shape.size / 2)[_QUADS]
        else:
            faces = np.asarray(obstacle.to_trimesh().triangles)
        low, high = obstacle.bounds
        look = {"facecolor": COLOURS["obstacle"], "edgecolor": "#8D94A0", "alpha": 0.25, "zorder": 2}
        axes.add_collection3d(Poly3DCollection(faces, linewidths=0.6, **look))
        axes.text(high[0], low[1], high[2], f" {obstacle.name}", fontsize=8, color="#666C77", zorder=3)
        corners.append(np.array([low, high]))
    return np.vstack(corners)


def draw_soles(axes: Axes3D, schedule: ContactSchedule) -> FloatArray:
    """Draw every contact of a schedule in three dimensions; return its points."""
    contacts = views.distinct_contacts(schedule)
    colours = colours_of(contact.effector for contact in contacts)
    for contact in contacts:
        colour = colours[contact.effector]
        if len(contact.points) > 2:
            sole = Poly3DCollection([contact.points_in_world], facecolor=colour, edgecolor=colour, alpha=0.4)
            sole.set_zorder(4)
            axes.add_collection3d(sole)
        else:
            axes.scatter(*contact.position, s=22, marker="s", color=colour, zorder=4, depthshade=False)
    return np.vstack([contact.points_in_world for contact in contacts])


def frame(axes: Axes3D, seen: FloatArray, corners: FloatArray) -> None:
    """Limit the axes to the motion and to the obstacles within a metre of it."""
    low, high = seen.min(axis=0) - 0.1, seen.max(axis=0) + 0.1
    if len(corners):
        low = np.minimum(low, np.maximum(corners.min(axis=0), low - 1.0))
        high = np.maximum(high, np.minimum(corners.max(axis=0), high + 1.0))
    low[2] = min(low[2] + 0.1, 0.0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    longest = float(np.max(high - low) / np.linalg.norm(high - low))
    zoom: Any = 1.16 * min(1.0, 0.85 / longest)  # the annotation says int, the function takes any number
    axes.set_box_aspect(high - low, zoom=zoom)
    spans = zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", (high - low) / (high - low).max(), strict=True)
    for axis, name, share in spans:
        axis.set_label_text(f"{name} [m]", fontsize=9)
        axis.labelpad = 4.0 if longest < 0.85 else 12.0  # numbers along a long axis hang lower
        axis.set_major_locator(MaxNLocator(max(round(MOST_TICKS * float(share)), 1)))
        axis.set_tick_params(labelsize=7)
        axis.pane.set_facecolor("#FAFBFC")
        axis.pane.set_edgecolor("#D5D9DF")
        axis._axinfo["grid"].update(color="#E3E6EA", linewidth=0.5)  # there is no public way
