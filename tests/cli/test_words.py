"""``manikin words``: counts by word, a partition that goes on where it was, one line for mistakes."""

import json
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import pytest

from manikin.cli import main
from manikin.cli.console import BAD_INPUT, DONE, INTERRUPTED
from manikin.walking import words
from manikin.walking.words import WordGrid, partition

TWO = ["words", "--slices", "340,150", "--jobs", "1"]


once = cache(partition.solve_slice)
"""Slices are the same in every test, and solved by the first that asks."""


@pytest.fixture(autouse=True)
def small_grid(monkeypatch):
    monkeypatch.setattr(words, "THESIS_GRID", WordGrid((-0.8, 0.4), (3.0, 3.4), 0.4))


@pytest.fixture
def solved(monkeypatch):
    """Headings of the slices that are solved in this process."""
    asked = []

    def counted(heading, grid):
        asked.append(heading)
        return once(heading, grid)

    monkeypatch.setattr(partition, "solve_slice", counted)
    return asked


def test_json_gives_counts_and_shares(capsys, solved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*TWO, "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["complete"]
    assert found["problems"] == found["solved"] == sum(found["counts"].values()) == 16
    assert sum(found["shares"].values()) == pytest.approx(1.0)
    assert list(found["counts"])[:6] == ["IDI", "DID", "IDID", "DIDI", "IDIDI", "DIDID"]
    assert found["others"] == [word for word in found["counts"] if len(word) not in (3, 4, 5)]
    assert solved == [150, 340]
    assert not list(tmp_path.iterdir())


def test_a_rerun_goes_on_and_draws(capsys, solved, tmp_path):
    out = ["--out", str(tmp_path / "w")]
    assert main(["words", "--slices", "340", "--jobs", "1", "--no-figures", *out]) == DONE
    assert not (tmp_path / "w" / "figures").exists()
    assert main([*TWO, *out]) == DONE
    assert solved == [340, 150]
    assert main([*TWO, *out, "--json"]) == DONE
    assert solved == [340, 150]
    for name in ("words.png", "equal_paths.png"):
        assert (tmp_path / "w" / "figures" / name).stat().st_size > 10_000
    captured = capsys.readouterr().out
    assert json.loads(captured[captured.index("{") :])["slices"].keys() == {"150", "340"}


def test_an_interrupted_run_keeps_what_it_solved(capsys, tmp_path, monkeypatch):

    def stopped(heading, grid):
        if heading == 340:
            raise KeyboardInterrupt
        return once(heading, grid)

    out = ["--out", str(tmp_path / "w"), "--no-figures"]
    monkeypatch.setattr(partition, "solve_slice", stopped)
    assert main([*TWO, *out]) == INTERRUPTED
    assert [file.name for file in (tmp_path / "w" / "slices").iterdir()] == ["150.npz"]
    assert not json.loads((tmp_path / "w" / "words.json").read_text())["complete"]
    monkeypatch.setattr(partition, "solve_slice", once)
    assert main([*TWO, *out]) == DONE
    assert json.loads((tmp_path / "w" / "words.json").read_text())["complete"]
    assert "all" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["words", "--slices", "15"], "'15' is no slice; valid: all, or 0, 10"),
        (["words", "--slices", ""], "'' is no slice"),
        (["words", "--slices", "10,360"], "'360' is no slice"),
        (["words", "--jobs", "0"], "--jobs"),
        (["words", "--json", "--figures"], "--figures does not go with this run"),
        (["words", "--out", "/dev/null", "--slices", "0"], "/dev/null: is a file"),
    ],
)
def test_mistakes_are_told_in_one_line(arguments, says, capsys):
    assert main(arguments) == BAD_INPUT
    captured = capsys.readouterr()
    assert says in captured.err
    assert captured.err.count("\n") == 1
    assert not captured.out


def children_of(process):
    file = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    return [int(word) for word in file.read_text().split()] if file.exists() else []


def running(pid):
    """Whether a process is there and not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


NEAR_GRID = """
from manikin.cli import main
from manikin.walking import words
words.THESIS_GRID = words.WordGrid((-0.6, 0.6), (3.0, 3.4), 0.2)
raise SystemExit(main())
"""
"""The command, on some of the thesis' goals that are near."""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc")
def test_a_killed_run_leaves_no_process_and_is_gone_on_with(tmp_path):
    """Killed while its two workers are busy; they end by themselves, and a rerun needs the rest only."""
    out = tmp_path / "w"
    command = [
        sys.executable,
        "-c",
        NEAR_GRID,
        "words",
        "--slices",
        "0,10,20",
        "--jobs",
        "2",
        "--no-figures",
    ]
    process = subprocess.Popen([*command, "--out", str(out)], stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 300
    while not list(out.glob("slices/0*.npz")) and time.monotonic() < deadline:
        time.sleep(0.05)
    workers = children_of(process)
    process.kill()
    process.wait()
    assert len(workers) >= 2
    while any(running(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(running(pid) for pid in workers)
    done = {file.name for file in out.glob("slices/*.npz")}
    assert done < {f"0{heading}0.npz" for heading in range(3)}
    before = {name: (out / "slices" / name).stat().st_mtime_ns for name in done}
    again = subprocess.run([*command, "--out", str(out), "--json"], capture_output=True, check=True)
    assert json.loads(again.stdout)["complete"]
    assert {name: (out / "slices" / name).stat().st_mtime_ns for name in done} == before
