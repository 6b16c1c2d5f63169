"""The motion file: exact, repeatable, whole or absent, and clear about what is wrong."""

import hashlib
import os
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.errors import MotionFileError
from manikin.motion import Motion
from manikin.motion.description import describe_scene
from manikin.motion.file import DATASETS, GROUPS, MotionFile, read_motions, write_motions
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere


def random_motion(body, n=50, seed=0):
    rng = np.random.default_rng(seed)
    names = ("left_foot", "right_foot", "right_hand")
    q = rng.standard_normal((n, body.nq))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    return Motion(
        time=np.cumsum(rng.uniform(1e-3, 2e-3, n)), q=q,
        v=rng.standard_normal((n, body.nv)), a=rng.standard_normal((n, body.nv)),
        tau=rng.standard_normal((n, body.nv)), com=rng.standard_normal((n, 3)),
        angular_momentum=rng.standard_normal((n, 3)), margin=rng.standard_normal(n) * 1e-300,
        support=rng.random((n, 3)) > 0.5, contact_force=rng.standard_normal((n, 3, 6)),
        contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip


@pytest.fixture(scope="module")
def content():
    body = human()
    tetrahedron = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    )
    shapes = [
        Box((1, 2, 3)), Sphere(0.1), Cylinder(0.1, 0.7), Capsule(0.2, 0.4), Plane((0, 1, 1), 0.3),
        HalfSpace((1, 2, 3), -1 / 3), tetrahedron,
    ]  # fmt: skip
    scene = Scene(
        [Obstacle(f"o{i}", s, None, (i / 7, 0.1, 3)) for i, s in enumerate(shapes)], floor_height=-0.1
    )
    left = sole("left_foot", (0, 0.1, 0), 0.3, length=0.28, width=0.12, friction=0.7, torsion_limit=20.0)
    hand = grasp("right_hand", (0.4, -0.2, 1.1), max_force=100.0, max_moment=1.0)
    sequence = StanceSequence([Phase(Stance([left, hand], 1500.0), 0.2, 3.0), Phase(Stance([left]), 0.1)])
    schedule = ContactSchedule(sequence, [0.0, 1 / 3, 0.7])
    recorded = random_motion(body, 30, 2)
    return MotionFile(random_motion(body), random_motion(body, 20, 1), body, scene, schedule, recorded)


def test_what_is_read_is_what_was_written(content, tmp_path):
    write_motions(tmp_path / "motion.h5", content)
    found = read_motions(tmp_path)
    for name, motion in content.motions.items():
        again = found.motions[name]
        for key, array in motion.arrays().items():
            np.testing.assert_array_equal(again.arrays()[key], array)
            assert again.arrays()[key].dtype == array.dtype
        assert (again.joint_names, again.contact_names) == (motion.joint_names, motion.contact_names)
    assert describe_scene(found.scene) == describe_scene(content.scene)
    assert found.body.signature() == content.body.signature()
    np.testing.assert_array_equal(found.schedule.instants, content.schedule.instants)
    for before, after in zip(content.schedule.sequence, found.schedule.sequence, strict=True):
        assert (before.min_duration, before.max_duration) == (after.min_duration, after.max_duration)
        assert before.stance.normal_force_cap == after.stance.normal_force_cap
        for a, b in zip(before.stance, after.stance, strict=True):
            assert a.same_place(b, tolerance=0.0)
            assert vars(a).keys() == vars(b).keys()
            assert all(np.array_equal(vars(a)[key], vars(b)[key]) for key in vars(a))


def test_body_of_the_file_moves_like_the_original(content, tmp_path):
    import pinocchio as pin

    write_motions(tmp_path / "motion.h5", content)
    body, again = content.body, read_motions(tmp_path).body
    q = pin.randomConfiguration(body.pinocchio, -np.ones(body.nq), np.ones(body.nq))
    np.testing.assert_array_equal(
        pin.crba(body.pinocchio, body.pinocchio.createData(), q),
        pin.crba(again.pinocchio, again.pinocchio.createData(), q),
    )
    assert again.segment_pairs == body.segment_pairs
    np.testing.assert_array_equal(again.standing_posture(), body.standing_posture())


def test_same_data_gives_the_same_bytes(content, tmp_path):
    digests = []
    for name in ("a.h5", "b.h5"):
        write_motions(tmp_path / name, content)
        digests.append(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
        time.sleep(1.1)  # a time stamp of one second's resolution would show
    assert digests[0] == digests[1]


def test_file_can_be_read_without_us(content, tmp_path):
    """Names, units and shapes as documented."""
    write_motions(tmp_path / "motion.h5", content)
    with h5py.File(tmp_path / "motion.h5") as file:
        assert set(file) == {"recorded", "planned", "executed", "body", "scene", "schedule"}
        for group in (file["recorded"], file["planned"], file["executed"]):
            assert set(group) == set(DATASETS)
            assert list(group.attrs["joint_names"]) == list(content.body.joint_names)
            assert list(group.attrs["contact_names"]) == ["left_foot", "right_foot", "right_hand"]
            assert all(group[name].attrs["unit"] == DATASETS[name][0] for name in DATASETS)


def test_planned_motion_alone_is_enough(content, tmp_path):
    write_motions(tmp_path / "motion.h5", MotionFile(planned=content.planned))
    found = read_motions(tmp_path / "motion.h5")
    assert list(found.motions) == ["planned"]
    assert (found.body, found.scene, found.schedule) == (None, None, None)
    with pytest.raises(MotionFileError, match="no motion"):
        write_motions(tmp_path / "motion.h5", MotionFile())


def damaged(path, content, damage):
    write_motions(path, content)
    with h5py.File(path, "r+") as file:
        damage(file)
    return path


def replaced(file, name, value):
    del file[name]
    file.create_dataset(name, data=value)


def linked(file, name, link):
    del file[name]
    file[name] = link


def outside(file, name):
    """A dataset whose numbers are the bytes of another file."""
    shape = file[name].shape
    del file[name]
    file.create_dataset(name, shape, np.float64, external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def vast(file, name, kind):
    """A dataset of 10^12 numbers that takes no room in the file, since none was written."""
    del file[name]
    file.create_dataset(name, (10**6, 10**6), kind, chunks=(1000, 1000), compression="gzip")


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda f: f.attrs.__delitem__("format"), "is not a motion file"),
        (lambda f: f.attrs.__setitem__("format_version", 99), "version 99"),
        (lambda f: f["planned"].__delitem__("q"), "planned/q is missing"),
        (lambda f: f["planned"].attrs.__delitem__("joint_names"), "planned/joint_names is missing"),
        (lambda f: [f.__delitem__(name) for name in GROUPS if name in f], "holds no motion"),
        (lambda f: f["planned/time"].__setitem__(3, -1.0), "time does not increase"),
        (lambda f: replaced(f, "planned/com", [1.0]), "com has shape"),
        (lambda f: f["planned/q"].__setitem__((3, 9), 1e300), "planned/q has the value 1e+300"),
        (lambda f: f["planned/q"].__setitem__((3, 9), np.nan), "planned/q is not finite"),
        (lambda f: f["planned/com"].__setitem__((3, 1), np.nan), "planned/com is not finite"),
        (lambda f: f["planned/q"].__setitem__((3, 6), 7.0), "quaternion of another norm"),
        (lambda f: f["executed/com"].__setitem__((3, 0), np.inf), "executed/com has the value inf"),
        (lambda f: linked(f, "planned/q", h5py.SoftLink("/planned/q")), "q is a link"),
        (lambda f: linked(f, "planned", h5py.SoftLink("/executed")), "planned is a link"),
        (lambda f: linked(f, "body", h5py.ExternalLink("/etc/passwd", "/")), "body is a link"),
        (lambda f: outside(f, "planned/com"), "lies in another file"),
        (lambda f: vast(f, "planned/q", np.float64), "MB of numbers; valid: at most 800 MB"),
        (lambda f: vast(f, "scene", np.uint8), "MB of numbers; valid: at most 800 MB"),
        (lambda f: replaced(f, "planned/com", b"text"), "planned"),
        (lambda f: replaced(f, "body", "{}"), "body is damaged"),
        (lambda f: replaced(f, "scene", "{"), "scene is damaged"),
        (lambda f: replaced(f, "schedule", 3.0), "schedule is damaged"),
    ],
)
def test_damaged_file_gives_one_line(content, tmp_path, damage, says):
    path = damaged(tmp_path / "motion.h5", content, damage)
    with pytest.raises(MotionFileError) as caught:
        read_motions(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_as_it_was_written_is_read_at_once_and_a_changed_one_is_tried_out(
    content, tmp_path, monkeypatch
):
    """Bytes that do not fit can make HDF5 compute for ever: a process with a time limit reads them first."""
    path = tmp_path / "motion.h5"
    write_motions(path, content)
    monkeypatch.setattr("manikin.runtime.hdf5.TIME_LIMIT", 1e-3)
    read_motions(path)
    with path.open("r+b") as file:
        file.seek(-1, os.SEEK_END)
        file.write(b"x")
    with pytest.raises(MotionFileError, match=r"reading it does not end within 0\.001 s"):
        read_motions(path)
    monkeypatch.undo()
    read_motions(path)


def test_missing_empty_and_foreign_files_give_one_line(content, tmp_path):
    (tmp_path / "text.h5").write_text("not HDF5")
    (tmp_path / "empty.h5").write_bytes(b"")
    write_motions(tmp_path / "cut.h5", content)
    (tmp_path / "cut.h5").write_bytes((tmp_path / "cut.h5").read_bytes()[:3000])
    for name in ("none.h5", "text.h5", "empty.h5", "cut.h5", "."):
        with pytest.raises(MotionFileError, match="valid") as caught:
            read_motions(tmp_path / name)
        assert "\n" not in str(caught.value)


def test_failed_write_keeps_the_old_file_and_no_other(content, tmp_path, monkeypatch):
    path = tmp_path / "motion.h5"
    write_motions(path, content)
    before = path.read_bytes()

    def fail(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("manikin.motion.description.describe_scene", fail)
    with pytest.raises(KeyboardInterrupt):
        write_motions(path, content)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["motion.h5"]  # noqa: PTH208


FULL = """
import resource, sys
from manikin.errors import MotionFileError
from manikin.motion.file import read_motions, write_motions
content = read_motions(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
try:
    write_motions(sys.argv[1], content)
except MotionFileError as error:
    print(error)
"""


@pytest.mark.skipif(os.name != "posix", reason="needs a limit on the size of files")
def test_no_room_on_the_disk_gives_one_line_and_keeps_the_old_file(content, tmp_path):
    """A limit on the size of files ends the write as a full disk does."""
    path = tmp_path / "motion.h5"
    write_motions(path, content)
    before = path.read_bytes()
    assert len(before) > 50_000
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(path)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "cannot be written (File too large)" in done.stdout
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["motion.h5"]  # noqa: PTH208


def test_folder_that_does_not_exist_gives_one_line(content, tmp_path):
    with pytest.raises(MotionFileError, match="cannot be written"):
        write_motions(tmp_path / "none" / "motion.h5", content)


WRITER = """
import sys
from manikin.cli.console import Interruption
from manikin.motion.file import MotionFile, read_motions, write_motions
content = read_motions(sys.argv[1])
with Interruption() as interruption:
    print("ready", flush=True)
    while True:
        write_motions(sys.argv[2], MotionFile(content.planned, None, content.body))
        # Python drops an exception that is raised in the callback of a weak reference, and h5py has many.
        interruption.check()
"""


@pytest.mark.parametrize(
    ("number", "times"),
    [
        (signal.SIGKILL, 1), pytest.param(signal.SIGKILL, 3, marks=pytest.mark.long),
        pytest.param(signal.SIGTERM, 1, marks=pytest.mark.long), (signal.SIGINT, 1),
    ],
)  # fmt: skip
def test_killed_writer_leaves_a_whole_file(content, tmp_path, number, times):
    """A process that writes the same file without pause is killed at arbitrary instants."""
    write_motions(tmp_path / "source.h5", MotionFile(random_motion(content.body, 2000), None, content.body))
    target = tmp_path / "target.h5"
    for attempt in range(times):
        command = [sys.executable, "-c", WRITER, str(tmp_path / "source.h5"), str(target)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
            process.stdout.readline()
            time.sleep(0.05 + 0.013 * attempt)
            process.send_signal(number)
            try:
                process.wait(timeout=30)
            finally:
                process.kill()
        if target.exists():
            found = read_motions(target)
            assert len(found.planned.time) == 2000
            assert found.body is not None
