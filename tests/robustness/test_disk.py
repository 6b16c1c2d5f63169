"""Full and read-only disks: one line, exit status 2, and nothing half written."""

import json
import shutil
import subprocess

import pytest

from manikin.cli import main


@pytest.fixture
def disk(tmp_path):
    """Mounts a disk in memory with some options; a test skips where that is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()

    def mounted(options):
        words = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
        if not shutil.which("mount") or subprocess.run(words, capture_output=True, check=False).returncode:
            pytest.skip("mounting a disk is not allowed here")
        return place

    yield mounted
    subprocess.run(["umount", "--lazy", str(place)], capture_output=True, check=False)


@pytest.mark.parametrize("size", ["20k", "300k"])
def test_a_full_disk_is_told_in_one_line(disk, standing_file, size, capfd):
    place = disk(f"size={size}")
    assert main(["analyze", str(standing_file), "--as-recorded", "--out", str(place / "run")]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "cannot be written (No space left on device); valid: " in line
    left = [item for item in place.rglob("*") if item.is_file()]
    assert not [item.name for item in left if item.suffix == ".tmp"]
    for item in left:
        if item.suffix == ".json":
            json.loads(item.read_text())


@pytest.mark.parametrize(
    "words",
    [
        ("run", "beam-H2C1"), ("run", "all"), ("words",), ("push", "--map"), ("walk", "--to", "1", "0", "0"),
        ("benchmark", "--families", "flat", "--seeds", "1", "--stage", "contacts"),
    ],
)  # fmt: skip
def test_a_read_only_disk_is_told_before_anything_is_computed(disk, words, capfd):
    place = disk("size=1m,ro")
    assert main([*words, "--out", str(place / "run")]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "cannot be written (Read-only file system); valid: in a writable directory" in line
