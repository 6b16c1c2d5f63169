"""OpenSim files, read by OpenSim in a process of its own and compared with the body and its motion.

OpenSim and casadi's wheel bring different versions of one library, which no process can load both.
"""

import json
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from tests.reports.export.test_bvh import make_motion

from manikin.body import Configuration, human, quadruped, random_configuration
from manikin.body.skin import segment_frames
from manikin.recordings.virtual_markers import marker_paths, virtual_markers
from manikin.reports.export import export_motion
from manikin.reports.formats.opensim import coordinates_mot, to_osim
from manikin.reports.formats.recorded import TO_OPENSIM, contact_loads

CHILD = """
import json, math, sys
import opensim
opensim.Logger.setLevelString("error")
model = opensim.Model(sys.argv[1])
state = model.initSystem()
table = opensim.TimeSeriesTable(sys.argv[2])
coordinates, bodies, markers = model.getCoordinateSet(), model.getBodySet(), model.getMarkerSet()
triple = lambda v: [v[0], v[1], v[2]]
frames = []
for row in range(table.getNumRows()):
    values = table.getRowAtIndex(row)
    for column, name in enumerate(table.getColumnLabels()):
        item = coordinates.get(name)
        turns = item.getMotionType() == opensim.Coordinate.Rotational
        item.setValue(state, math.radians(values[column]) if turns else values[column], False)
    model.realizePosition(state)
    frames.append({
        "com": triple(model.calcMassCenterPosition(state)),
        "bodies": {bodies.get(k).getName(): triple(bodies.get(k).getPositionInGround(state))
                   for k in range(bodies.getSize())},
        "markers": [triple(markers.get(k).getLocationInGround(state)) for k in range(markers.getSize())],
    })
inertia = {}
for k in range(bodies.getSize()):
    found = bodies.get(k).getInertia()
    inertia[bodies.get(k).getName()] = triple(found.getMoments()) + triple(found.getProducts())
forces = opensim.ExternalLoads(sys.argv[3], True).getSize() if len(sys.argv) > 3 else 0
json.dump({"mass": model.getTotalMass(state), "frames": frames, "inertia": inertia, "forces": forces,
           "masses": {bodies.get(k).getName(): bodies.get(k).getMass() for k in range(bodies.getSize())}},
          sys.stdout)
"""


def by_opensim(*files):
    """What OpenSim finds in a model and a motion."""
    if find_spec("opensim") is None:
        pytest.skip("OpenSim is not installed (extra 'opensim')")
    command = [sys.executable, "-c", CHILD, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    # What it prints at its end, of memory, stands behind.
    return json.JSONDecoder().raw_decode(done.stdout[done.stdout.index("{") :])[0]


@pytest.mark.parametrize("make", [human, quadruped])
def test_opensim_puts_every_segment_where_we_do(make, tmp_path):
    body, rng = make(), np.random.default_rng(2)
    motion = make_motion(body, np.array([random_configuration(body, rng) for _ in range(5)]))
    markers = virtual_markers(body) if make is human else ()
    (tmp_path / "a.osim").write_text(to_osim(body, markers))
    (tmp_path / "a.mot").write_text(coordinates_mot(body, motion))
    found = by_opensim(tmp_path / "a.osim", tmp_path / "a.mot")
    assert found["mass"] == pytest.approx(body.mass, rel=1e-9)
    for segment in body.segments:
        wanted = TO_OPENSIM @ segment.inertia @ TO_OPENSIM.T
        six = wanted[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        np.testing.assert_allclose(found["inertia"][segment.name], six, atol=1e-6 * np.abs(six).max())
        assert found["masses"][segment.name] == pytest.approx(segment.mass, rel=1e-9)
    paths = marker_paths(body, markers, motion.q) @ TO_OPENSIM.T if markers else np.zeros((5, 0, 3))
    # 10 digits of degrees and metres are written; 0.1 mm is what is promised.
    for q, frame, marked in zip(motion.q, found["frames"], paths, strict=True):
        np.testing.assert_allclose(frame["com"], TO_OPENSIM @ Configuration(body, q).com, atol=1e-6)
        for segment, origin in zip(body.segments, segment_frames(body, q)[1], strict=True):
            np.testing.assert_allclose(frame["bodies"][segment.name], TO_OPENSIM @ origin, atol=1e-6)
        np.testing.assert_allclose(np.reshape(frame["markers"], (-1, 3)), marked, atol=1e-6)


def test_a_run_becomes_a_model_its_motion_and_its_forces(finished_run, tmp_path):
    assert export_motion(finished_run, tmp_path, "osim", rate=4.0) == tmp_path / "motion.osim"
    names = ("motion.osim", "motion.mot", "motion_grf.xml")
    assert {path.name for path in tmp_path.iterdir()} == {*names, "motion_grf.mot"}
    found = by_opensim(*(tmp_path / name for name in names))
    assert found["forces"] == 2
    assert len(found["frames"]) == 21


def test_loads_are_the_contact_forces_about_other_points(finished_run):
    """Force and moment about the world's origin are those of the motion, wherever the force acts."""
    motion, body = finished_run.executed, finished_run.body
    for number, (name, (force, place, moment)) in enumerate(contact_loads(body, motion).items()):
        given = motion.contact_force[:, number] * motion.support[:, number, None]
        np.testing.assert_allclose(force, given[:, :3])
        path = np.array([Configuration(body, q).effector_placement(name)[1] for q in motion.q[::200]])
        about = given[::200, 3:] + np.cross(path, force[::200])
        np.testing.assert_allclose((moment + np.cross(place, force))[::200], about, atol=1e-9)
