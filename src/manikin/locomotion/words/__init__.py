"""Words of walking: smoothest paths and the partition of their goals by word ([Truong2010]_ 3.3)."""

from manikin.locomotion.words.border import EqualPaths, bent_to, equal_paths
from manikin.locomotion.words.certificate import WordResiduals, residuals
from manikin.locomotion.words.grid import HEADINGS, THESIS_GRID, WordGrid
from manikin.locomotion.words.partition import WordSlice, count_words, shares, solve_slice
from manikin.locomotion.words.path import STRAIGHT, THESIS_WORDS, WordPath
from manikin.locomotion.words.processes import solve_slices
from manikin.locomotion.words.solve import word_path, word_paths

__all__ = [
    "HEADINGS",
    "STRAIGHT",
    "THESIS_GRID",
    "THESIS_WORDS",
    "EqualPaths",
    "WordGrid",
    "WordPath",
    "WordResiduals",
    "WordSlice",
    "bent_to",
    "count_words",
    "equal_paths",
    "residuals",
    "shares",
    "solve_slice",
    "solve_slices",
    "word_path",
    "word_paths",
]
