"""Compare models of walking paths with recorded walks that were not fitted: writes ``path-models.md``.

Run ``python docs/path_models.py FOLDER`` with the folder of ``docs/inverse.py``, whose 42 walks these are.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from acknowledgements import THANKS
from identify_objective import HEADING_LENGTH, RecordedWalk, identify_objective, share_errors, task_of
from inverse import Clip, centimetres, clips, row
from scipy.stats import binomtest

from manikin.errors import InputError, SolverError
from manikin.numerics.spatial import FloatArray
from manikin.walking import RECORDED_WALKS
from manikin.walking.path.path_models import COMPARED, OptimalModel, PathModel
from manikin.walking.path.walking_model import TERMS

PAGE = Path(__file__).with_name("path-models.md")
FOLDS = 3
TOLERANCE = 1e-2
"""Of the logarithms of fitted weights."""
FIRST_FURTHER = {"jerk": 0.05, "speed": 0.05, "work": 0.05, "turning": 0.05}
"""Where the weights of further terms begin."""

TEXT = """# Models of walking paths

How far do models of the way that somebody walks come from where people walked? The {count} recorded walks are
those of [the weights](inverse.md): reduced to the middle of the shoulders without the sway of the steps.
Every model is told where a walk begins and ends and the velocities there. Weights are fitted to two thirds
of the walks, and the other third is predicted, in turn: no number below is of a walk that was fitted.
*Error*: mean distance between recorded and predicted place at equal shares of both durations; the people of
the thesis differ among themselves by 14 cm (4.4). By `docs/path_models.py`.

"""
MODELS = """## Models

Models of optimal control are one objective with different weights (`manikin.walking.path.path_models`), each
with the weight of time 1; the weights named are fitted. Fajen and Warren's steering has its published
numbers, clothoid words have none.

"""
MODELS_END = """
The criterion has the least median and is the nearest in turns, where heading and way part. Minimum jerk has
the least mean and is nearer in the walks without a turn that was asked for; over all walks the difference is
within chance. A price of changes of speed adds nothing to it: its weight ends at the least that is tried.
Steering and clothoid words have nothing that is fitted; where heading and way part, words make detours.

"""
FURTHER = """
## Further terms

The thesis says that velocities, jerks and energies in the cost make the prediction worse, and that inverse
optimal control determines their weights to be zero (5.6). Here one term at a time is added to (5.6), its
weight fitted with the four others. *Kept* is a term that lowers the error of predicted walks, and that in
more walks than chance allows (sign test below 5 %).

"""
END = """
No term is kept. With `speed` the mean falls and so does the error of turns, but most walks are farther;
its weight is not zero as in the thesis. `turning` ends at next to nothing. With `jerk` some predictions are
far off, which the mean shows and the median does not.

* `speed`: the square of the speed, which is kinetic energy, and with the weight of time also the metabolic
  rate of level walking, a constant and a multiple of that square (Ralston 1958). `turning`: the square of the
  angular velocity. `jerk`: of the place. `work`: mechanical work of either sign per mass.

"""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Errors at equal shares of walks that were not fitted [m], and the weights of every fold."""

    errors: FloatArray
    weights: FloatArray


def cross_validated(walks: Sequence[RecordedWalk], model: PathModel) -> Prediction:
    """Every third walk is predicted by the model as the others say."""
    errors, weights = np.full(len(walks), np.nan), []
    for fold in range(FOLDS):
        fitted = model
        if isinstance(model, OptimalModel):
            kept = [walk for number, walk in enumerate(walks) if number % FOLDS != fold]
            fitted = fit(kept, model)
            weights.append([getattr(fitted.objective, name) for name in model.names])
        for number in range(fold, len(walks), FOLDS):
            errors[number] = error(walks[number], fitted)
    return Prediction(errors, np.array(weights))


def fit(walks: Sequence[RecordedWalk], model: OptimalModel) -> OptimalModel:
    """The model with the weights that recorded walks say."""
    found = identify_objective(
        [along(walk) if model.along else walk for walk in walks], model.objective, names=model.names,
        heading_length=HEADING_LENGTH if model.heading else 0.0, tolerance=TOLERANCE,
    )  # fmt: skip
    return replace(model, objective=found.objective)


def along(walk: RecordedWalk) -> RecordedWalk:
    """A walk that begins and ends along its heading."""
    ends = (velocity * [1.0, 0.0, 1.0] for velocity in (walk.start_velocity, walk.goal_velocity))
    return RecordedWalk(walk.time, walk.place, walk.start, walk.goal, *ends)


def error(walk: RecordedWalk, model: PathModel) -> float:
    """At equal shares [m]; nan where the model has no walk."""
    try:
        return float(share_errors([walk], [model.walk(task_of(walk, RECORDED_WALKS))])[0])
    except (InputError, SolverError) as failure:
        print(failure, file=sys.stderr)
        return float("nan")


def cells(found: Prediction, parts: dict[str, Callable[[Clip], bool]], clips_: Sequence[Clip]) -> list[str]:
    """Mean errors of parts of the walks, and the median."""
    chosen = [np.array([choose(clip) for clip in clips_]) for choose in parts.values()]
    means = [centimetres(float(np.nanmean(found.errors[some]))) for some in chosen]
    return [*means, centimetres(float(np.nanmedian(found.errors)))]


def told(found: Prediction, names: Sequence[str]) -> str:
    """Range of the weights over the folds."""
    if not len(found.weights):
        return ""
    low, high = found.weights.min(axis=0), found.weights.max(axis=0)
    return ", ".join(f"{name} {a:.2g} to {b:.2g}" for name, a, b in zip(names, low, high, strict=True))


PARTS: dict[str, Callable[[Clip], bool]] = {
    "all": lambda clip: clip is not None,
    "turns": lambda clip: clip.turns,
    "others": lambda clip: not clip.turns,
}


def nearer(first: FloatArray, second: FloatArray) -> tuple[int, int, float]:
    """In how many walks the first errors are smaller, of how many, and the odds of that by chance."""
    both = ~np.isnan(first) & ~np.isnan(second)
    wins = int(np.sum(first[both] < second[both]))
    return wins, int(both.sum()), float(binomtest(wins, int(both.sum())).pvalue)


def models(found: Sequence[Clip]) -> tuple[Prediction, Iterator[str]]:
    """Predictions of the criterion, and the table of all models."""
    walks = [clip.walk for clip in found]
    predictions = {}
    for name, model in COMPARED.items():
        if isinstance(model, OptimalModel) and name == "criterion":
            model = replace(model, objective=RECORDED_WALKS)
        predictions[name] = cross_validated(walks, model), model
        print(name, cells(predictions[name][0], PARTS, found), file=sys.stderr)
    ours = predictions["criterion"][0]

    def lines() -> Iterator[str]:
        yield from row("model", "weights by fold", *PARTS, "median", "criterion nearer", "p")
        for name, (one, model) in predictions.items():
            names = model.names if isinstance(model, OptimalModel) else ()
            wins, count, odds = nearer(ours.errors, one.errors)
            against = ("", "") if one is ours else (f"{wins} of {count}", f"{odds:.2g}")
            yield from row(name, told(one, names), *cells(one, PARTS, found), *against, head=False)

    return ours, lines()


def further(found: Sequence[Clip], without: Prediction) -> Iterator[str]:
    """Table of the further terms."""
    walks = [clip.walk for clip in found]
    yield from row("added term", "weights by fold", *PARTS, "median", "nearer than without", "p", "verdict")
    yield from row("none", told(without, TERMS[1:]), *cells(without, PARTS, found), "", "", "", head=False)
    for name, weight in FIRST_FURTHER.items():
        objective = replace(RECORDED_WALKS, **{name: weight})
        one = cross_validated(walks, OptimalModel(objective, (*TERMS[1:], name)))
        wins, count, odds = nearer(one.errors, without.errors)
        better = np.nanmean(one.errors) < np.nanmean(without.errors) and odds < 0.05 and 2 * wins > count
        yield from row(
            f"`{name}`", told(one, (*TERMS[1:], name)), *cells(one, PARTS, found), f"{wins} of {count}",
            f"{odds:.2g}", "kept" if better else "rejected", head=False,
        )  # fmt: skip
        print(name, cells(one, PARTS, found), wins, odds, file=sys.stderr)


def main(folder: Path) -> None:
    """Write the page."""
    found = list(clips(folder))
    ours, table = models(found)
    text = TEXT.format(count=len(found)) + MODELS + "\n".join(table) + "\n" + MODELS_END
    PAGE.write_text(text + THANKS)
    text += FURTHER
    for line in further(found, ours):
        text += line + "\n"
        PAGE.write_text(text + END + THANKS)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
