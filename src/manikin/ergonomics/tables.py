"""Scores as places in published tables."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError

Scores = NDArray[np.int64]


def looked_up(table: Scores, **steps: ArrayLike) -> Scores:
    """Entries of a table whose axes all begin with the score 1.

    Args:
        table: One axis per step.
        steps: Scores of each axis in order, arrays or numbers; their names are those of the messages.

    Raises:
        InputError: If a score is no whole number from 1 to the length of its axis.
    """
    places = [
        checked(score, 1, size, name) - 1
        for (name, score), size in zip(steps.items(), table.shape, strict=True)
    ]
    return table[tuple(np.broadcast_arrays(*places))]


def checked(score: ArrayLike, least: int, largest: int, name: str) -> Scores:
    """Scores as whole numbers.

    Raises:
        InputError: If one of them is none, or not from the least to the largest.
    """
    values = np.asarray(score)
    wrong = values[~((values >= least) & (values <= largest) & (values == np.round(values)))]
    if np.size(wrong):
        said = name.replace("_", " ")
        raise InputError(f"{said} score is {wrong[0]}; valid: whole numbers from {least} to {largest}")
    return values.astype(np.int64)
