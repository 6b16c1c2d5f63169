"""A small share of ``python -m tests.robustness --leaks 200``."""

import mmap
import sys

import pytest
from tests.robustness.leaks import CALLS, MOST, growth, growths, resident

from manikin.runtime.memory import give_memory_back


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is read from /proc")
@pytest.mark.parametrize(
    "name",
    [
        "margin", "scenario", "c3d",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in (*CALLS, "stance", "bvh", "stl", "urdf")
            if name != "margin"
        ),
    ],
)  # fmt: skip
def test_memory_does_not_grow_with_the_number_of_calls(name):
    assert growths(20, [name])[name] <= MOST


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is read from /proc")
def test_a_leak_is_found():
    """Memory that a call keeps, in pages of its own, is counted to the byte."""
    kept, size = [], 1 << 20

    def leak():
        kept.append(mmap.mmap(-1, size))
        kept[-1].write(b"x" * size)

    assert growth(leak, 8) == pytest.approx(size, rel=0.05)


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is read from /proc")
def test_memory_between_what_is_kept_is_given_back():
    """A hundred thousand pieces of 1 kB, of which each hundredth is kept: holes of 100 kB."""
    pieces = [bytes(1024) for _ in range(100_000)]
    kept = pieces[::100]
    del pieces
    before = resident()
    give_memory_back()
    assert len(kept) == 1000
    assert resident() < before - 50e6
