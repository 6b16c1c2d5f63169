"""The centres of mass of two runs: in space, on the coordinate planes, in time."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from manikin.comparison import RunComparison
from manikin.figures.compare_timing import RUN_COLOURS
from manikin.figures.labels import Labels
from manikin.figures.planes import draw_paths, frame_plane, mark_instants, planes_grid
from manikin.figures.scene import draw_scene, draw_soles, frame
from manikin.figures.style import legend_in_title, need, new_figure
from manikin.figures.views import VIEWS
from manikin.record import ComTrack


def compare_planes_figure(comparison: RunComparison) -> Figure:
    """Draw both CoM paths on xy, xz and yz, enlarged to the paths ([Qiu2012]_ Fig. 7.18).

    Raises:
        FigureError: If a run has no CoM.
    """
    tracks = _tracks(comparison)
    seen = np.vstack([track.position for track in tracks.values()])
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = 0.08 * float((high - low).max()) + 0.01
    low, high = low - room, high + room
    figure, grid = planes_grid("Centres of mass of two runs on the coordinate planes", high - low)
    for column, view in enumerate(VIEWS):
        axes = figure.add_subplot(grid[column])
        draw_paths(axes, view, tracks, _styles(comparison))
        frame_plane(axes, view, low, high)
        labels = Labels(axes)
        for run, track, colour in zip(comparison.runs, tracks.values(), RUN_COLOURS, strict=True):
            if run.phases is not None:
                mark_instants(labels, axes, view, track.at(run.phases.instants), colour)
    legend_in_title(figure, axes)
    return figure


def compare_scene_figure(comparison: RunComparison) -> Figure:
    """Draw both CoM paths in space, with the scene and supports of the first run ([Qiu2012]_ Fig. 7.17).

    Raises:
        FigureError: If a run has no CoM.
    """
    tracks, first = _tracks(comparison), comparison.first
    figure = new_figure(9.5, 8.0, "Centres of mass of two runs")
    axes: Axes3D = figure.add_subplot(projection="3d", computed_zorder=False)
    seen = [track.position for track in tracks.values()]
    corners = draw_scene(axes, first.scene) if first.scene is not None else np.zeros((0, 3))
    if first.schedule is not None:
        seen.append(draw_soles(axes, first.schedule))
    for name, track in tracks.items():
        axes.plot(*track.position.T, label=name, **{**_styles(comparison)[name], "zorder": 8})
    frame(axes, np.vstack(seen), corners)
    axes.view_init(14.0, -62.0)
    axes.legend(loc="upper right", fontsize=8, frameon=False)
    return figure


def _tracks(comparison: RunComparison) -> dict[str, ComTrack]:
    """The planned CoM of each run."""
    found = {}
    for name, run in zip(comparison.names, comparison.runs, strict=True):
        found[name] = next(iter(need(run.tracks, "a centre of mass of both runs").values()))
    return found


def _styles(comparison: RunComparison) -> dict[str, dict[str, Any]]:
    thick, thin = {"linewidth": 2.4, "zorder": 3}, {"linewidth": 1.2, "zorder": 4}
    colours = {"color": RUN_COLOURS[0]}, {"color": RUN_COLOURS[1]}
    return dict(zip(comparison.names, ({**colours[0], **thick}, {**colours[1], **thin}), strict=True))
