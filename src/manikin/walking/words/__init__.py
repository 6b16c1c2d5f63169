"""Words of walking: smoothest paths and the partition of their goals by word ([Truong2010]_ 3.3)."""

from manikin.walking.words.partition import (
    HEADINGS,
    THESIS_GRID,
    EqualPaths,
    WordGrid,
    WordSlice,
    bent_to,
    count_words,
    equal_paths,
    shares,
    solve_slice,
    solve_slices,
)
from manikin.walking.words.word_solver import (
    STRAIGHT,
    THESIS_WORDS,
    WordPath,
    residuals,
    word_path,
    word_paths,
)

__all__ = [
    "HEADINGS", "STRAIGHT", "THESIS_GRID", "THESIS_WORDS", "EqualPaths", "WordGrid", "WordPath",
    "WordSlice", "bent_to", "count_words", "equal_paths", "residuals", "shares", "solve_slice",
    "solve_slices", "word_path", "word_paths",
]  # fmt: skip
