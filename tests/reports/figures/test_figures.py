"""Figures: what they show, that the same run gives the same bytes, and that no window is needed."""

import contextlib
from dataclasses import replace
from itertools import combinations

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection

from manikin.errors import FigureError, MotionFileError
from manikin.motion.file import MotionFile
from manikin.motion.motion import segment_positions
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.figures import (
    FIGURES,
    com_figure,
    contacts_figure,
    effectors_figure,
    flights_figure,
    footprint_figure,
    margin_figure,
    planes_figure,
    postures_figure,
    scene_figure,
    timing_figure,
    tracking_figure,
    write_figures,
    zmp_figure,
)
from manikin.reports.figures.scene import LEAST_CHANGE, MOST, chosen_postures, eventful_instants
from manikin.reports.figures.timeline import phase_minima
from manikin.reports.figures.views import ABOVE, ALONG_Y, best_view

PNG = b"\x89PNG\r\n\x1a\n"


def labels(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


def drawn(figure, values):
    """Whether some line of the figure has exactly these ordinates."""
    lines = figure.findobj(matplotlib.lines.Line2D)
    return any(np.array_equal(line.get_ydata(), values) for line in lines)


def test_every_figure_is_written_and_is_the_same_again(run, tmp_path, monkeypatch):
    shares = []
    written = write_figures(run, tmp_path, shares.append)
    assert [path.stem for path in written] == [
        name for name in FIGURES if name not in ("operations", "walk_paths")
    ]
    assert shares[-1] == 1.0
    first = {path.name: path.read_bytes() for path in written}
    assert all(data.startswith(PNG) for data in first.values())
    for name in set(FIGURES) - {"margin", "postures", "contacts"}:  # one of each kind again
        monkeypatch.delitem(FIGURES, name)
    write_figures(run, tmp_path)
    assert {path.name: path.read_bytes() for path in written} == first
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(first)


def test_no_global_state_is_left():
    import sys

    import manikin.reports.figures  # noqa: F401

    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def applicable(record):
    """Names of the figures that do not refuse."""
    found = set()
    for name, draw in FIGURES.items():
        with contextlib.suppress(FigureError):
            draw(record)
            found.add(name)
    return found


@pytest.mark.long
def test_only_what_a_run_has_is_drawn(run, planned_only, walls, seated, failed):
    """No walk: no ways. No execution: no tracking. On walls: no feet, no ZMP. Nothing planned: nothing."""
    every = set(FIGURES) - {"walk_paths"}
    assert applicable(run) == every
    assert applicable(planned_only) == every - {"tracking"}
    assert applicable(seated) == every - {"tracking"}
    assert applicable(walls) == {"com", "margin", "planes", "contacts", "timing", "scene"}
    assert applicable(failed) == set()


def test_a_motion_without_body_and_schedule_is_drawn_as_far_as_it_goes(finished_run):
    bare = RunRecord("bare", MotionFile(finished_run.planned))
    assert applicable(bare) == {"com", "margin", "footprints", "planes", "scene"}


def test_com_figure_shows_both_motions_on_nine_labelled_axes(run):
    figure = com_figure(run)
    named = {axes.get_ylabel(): axes for axes in figure.axes if axes.get_ylabel()}
    assert set(named) == {f"{axis} [{unit}]" for axis in "xyz" for unit in ("m", "m/s", "m/s²")}
    lines = named["y [m]"].get_lines()
    np.testing.assert_array_equal(lines[-2].get_ydata(), run.motions["planned"].com[:, 1])
    np.testing.assert_array_equal(lines[-1].get_ydata(), run.motions["executed"].com[:, 1])
    # Time runs to the end of the execution, a second after the last phase.
    assert named["y [m]"].get_xlim() == (0.0, run.motions["executed"].time[-1])


def test_point_mass_is_drawn_with_the_derivatives_of_its_spline(walls):
    figure = com_figure(walls)
    for values in (walls.plan.position, walls.plan.velocity, walls.plan.acceleration):
        assert drawn(figure, values[:, 2])


def test_margin_figure_names_the_limiting_phase(run):
    motion = run.motions["planned"]
    lowest = int(np.argmin(motion.margin))
    phase = int(run.schedule.phase_at(motion.time[lowest]))
    text = " ".join(labels(margin_figure(run)))
    assert (
        f"planned (lowest {motion.margin[lowest]:.1f} N.m in phase {phase}, {motion.time[lowest]:.2f} s)"
        in text
    )


def test_margin_of_the_point_mass_is_drawn_beside_that_of_the_body(run):
    """A margin in newtons gets axes of its own."""
    time = np.linspace(0.0, 4.0, 50)
    still = np.zeros((50, 3))
    for unit, panels in (("N.m", 1), ("N", 2)):
        plan = ComTrack(time, still, still, still, 25.0 + time, unit)
        figure = margin_figure(replace(run, plan=plan))
        assert drawn(figure, plan.margin)
        assert sum(axes.get_ylabel().startswith("margin") for axes in figure.axes) == panels


def test_a_margin_that_grows_is_shown_enlarged_too(seated):
    """Seated, the margin is ten times that of standing; the second panel ends below it."""
    axes = [axes for axes in margin_figure(seated).axes if axes.get_ylabel().startswith("margin")]
    assert [one.get_ylabel() for one in axes] == ["margin [N.m]", "margin, lower part [N.m]"]
    assert axes[0].get_ylim()[1] > 220.0
    assert 20.0 < axes[1].get_ylim()[1] < 60.0


def test_smallest_margin_of_each_phase(seated):
    track = seated.tracks["planned"]
    assert [track.margin[i] for i in phase_minima(track, seated.phases)] == [20.0, 20.0, 20.0, 20.0, 20.0]


def test_footprints_are_numbered_in_the_order_they_are_made(run):
    text = labels(footprint_figure(run))
    for label in ("1: left foot", "2: right foot", "3: left foot", "4: right foot\nz = 0.2 m"):
        assert label in text
    assert any("roof" in label for label in text)


def test_zmp_figure_plots_the_distances_where_they_decide(run):
    """With feet at two heights (phase 4) the curve is dotted; the least decisive distance is named."""
    path = run.zmp["planned"]
    assert set(np.unique(path.phase[path.decisive])) == {0, 1, 2, 3, 5, 6}
    millimetres = np.where(path.decisive, 1000.0 * path.distance, np.nan)
    figure = zmp_figure(run)
    lines = [
        line for line in figure.findobj(matplotlib.lines.Line2D) if len(line.get_ydata()) == len(path.time)
    ]
    assert any(np.array_equal(line.get_ydata(), millimetres, equal_nan=True) for line in lines)
    assert any(f"least {np.nanmin(millimetres):.1f} mm" in text for text in labels(figure))


def test_point_mass_in_space_has_a_leg_to_every_contact(walls):
    """Four legs in the three phases on four feet, two in the two others."""
    axes = scene_figure(walls).axes[0]
    legs = [c for c in axes.collections if isinstance(c, LineCollection)]
    assert [len(c.get_segments()) for c in legs] == [4, 2, 4, 2, 4]


def test_motion_of_a_body_without_joints_is_that_of_a_point_mass(finished_run, walls):
    """Its file holds a pelvis that carries the CoM and nothing else; there is no posture to draw."""
    given = finished_run.planned
    n = len(given.time)
    zero = np.zeros((n, 6))
    lone = replace(given, q=given.q[:, :7], v=zero, a=zero, tau=zero, joint_names=())
    record = RunRecord("lone", MotionFile(lone, schedule=finished_run.schedule))
    assert record.motions == {}
    np.testing.assert_array_equal(record.tracks["planned"].position, lone.com)
    assert applicable(record) == applicable(walls) | {"footprints"}


def test_planes_show_the_path_on_each_plane(run):
    figure = planes_figure(run)
    com = run.motions["planned"].com
    for axes, (right, up) in zip(figure.axes, ((0, 1), (0, 2), (1, 2)), strict=True):
        lines = [line.get_xydata() for line in axes.get_lines()]
        assert any(np.array_equal(line, com[:, [right, up]]) for line in lines)
        assert axes.get_xlabel() == f"{'xyz'[right]} [m]"
        assert axes.get_ylabel() == f"{'xyz'[up]} [m]"


def test_contacts_are_seen_from_above_and_on_walls_along_them(run, walls):
    assert best_view(run.schedule) is ABOVE
    assert best_view(walls.schedule) is ALONG_Y
    text = labels(contacts_figure(walls))
    assert "1: 0.50–0.80 s" in text
    assert "Contacts of each phase, along y" in text


def test_timing_bars_are_the_durations_and_mark_the_shortest(run):
    axes = timing_figure(run).axes[0]
    bars = [patch for patch in axes.patches if patch.get_width() == pytest.approx(0.62)]
    np.testing.assert_allclose([bar.get_height() for bar in bars], run.schedule.durations, atol=1e-12)
    # Phases 1, 3 and 5 of the published solution last exactly as long as they must.
    assert [number for number, bar in enumerate(bars) if bar.get_hatch()] == [1, 3, 5]


def test_a_motion_in_one_stance_is_drawn_where_much_happens(seated):
    """Still for a second and then turning ever faster: equal turns from each instant to the next."""
    motion = list(seated.motions.values())[-1]
    turned = np.clip(motion.time - 1.0, 0.0, None) ** 2
    q = motion.q.copy()
    q[:, 7:9] += turned[:, None]
    instants = eventful_instants(replace(motion, q=q))
    assert len(instants) == MOST
    np.testing.assert_allclose(instants[[0, -1]], motion.time[[0, -1]])
    # Samples are 10 ms apart: a turn read between two of them is off by at most a part in 2500.
    shares = np.diff(np.clip(instants - 1.0, 0.0, None) ** 2)
    np.testing.assert_allclose(shares, 1.0 / (MOST - 1), atol=1e-3)


def test_postures_are_labelled_with_the_key_instants(run, seated):
    text = labels(postures_figure(run))
    assert {f"{instant:.2f} s" for instant in run.schedule.instants} <= set(text)
    assert any("planned" in label for label in labels(postures_figure(seated)))


def test_flights_are_those_of_the_schedule(run):
    """Heights of the drawn flights are those of the planned motion between lift-off and landing."""
    figure = flights_figure(replace(run, summary={
        "wholebody": {"swings": [
            {"effector": "left_foot", "method": "smooth"}, {"effector": "right_foot", "method": "bi-rrt"},
            {"effector": "left_foot", "method": "smooth"},
        ]},
    }))  # fmt: skip
    time, foot = run.motions["planned"].time, run.effector_paths["planned"]["right_foot"]
    flight = (time >= 0.93 - 1e-9) & (time <= 1.73 + 1e-9)
    assert drawn(figure, foot[flight, 2])
    assert "right foot, phase 3, bi-rrt" in labels(figure)


def test_effector_coordinates_are_those_of_the_body(run, seated):
    figure = effectors_figure(run)
    for kind, paths in run.effector_paths.items():
        assert drawn(figure, paths["left_foot"][:, 1]), kind
    titles = [axes.get_title(loc="left") for axes in effectors_figure(seated).axes]
    assert {"Left foot", "Right foot", "Right hand", "Pelvis"} <= set(titles)


def test_tracking_errors_are_those_of_the_data(run):
    """The executed CoM is off by 3 mm sin(9 t) along each axis, and so is the whole body."""
    size = np.abs(3.0 * np.sqrt(3.0) * np.sin(9.0 * run.motions["executed"].time))
    text = " ".join(labels(tracking_figure(run)))
    assert f"largest {size.max():.1f} mm" in text


def test_scene_is_drawn_to_scale(run):
    """A metre across is a metre upward, and the path lies on the picture of its scene."""
    axes = scene_figure(run).axes[0]
    axes.apply_aspect()
    (x0, y0), (x1, _y1), (_x2, y2) = axes.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    assert x1 - x0 == pytest.approx(y2 - y0, rel=1e-9)
    left, right, bottom, top = axes.images[0].get_extent()
    for line in axes.get_lines():
        x, y = np.asarray(line.get_data(), dtype=float)
        assert left < x.min() < x.max() < right
        assert bottom < y.min() < y.max() < top


def test_bodies_in_one_picture_differ(run):
    """Their segments are apart by the least change or more; that at the last key instant is among them."""
    motion = list(run.motions.values())[-1]
    _, postures = chosen_postures(run.body, motion, run.schedule)
    places = [np.vstack(list(segment_positions(run.body, q).values())) for q in postures]
    for first, second in combinations(places, 2):
        assert np.sqrt(np.mean(np.sum((first - second) ** 2, axis=1))) >= LEAST_CHANGE
    last = np.argmin(np.abs(motion.time - run.schedule.instants[-1]))
    np.testing.assert_array_equal(postures[-1], motion.q[last])


def test_folder_that_does_not_exist_gives_one_line(run, tmp_path):
    with pytest.raises(MotionFileError, match="cannot be written"):
        write_figures(run, tmp_path / "none")
