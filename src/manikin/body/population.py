"""People of a population: boundary bodies, percentile bodies and random draws from published statistics.

The population is that of the 2012 Anthropometric Survey of U.S. Army Personnel (ANSUR II; Gordon et al.,
NATICK/TR-15/007; 4082 men and 1986 women, 17 to 58 years): means, standard deviations and correlations,
computed from its public data. Soldiers are fitter and younger than a civil population.

A person is a vector of :data:`MEASURES_OF_A_PERSON`, normally distributed for each sex. The ellipsoid that
holds a share of the people is where the squared Mahalanobis distance from the mean is that quantile of chi
squared, with as many degrees of freedom as measures. Leg length is not drawn: it follows from stature and
sitting height.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.special import chdtri, ndtri
from scipy.stats.qmc import MultivariateNormalQMC, Sobol

from manikin.body.anthropometry import Sex
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array

MEASURES_OF_A_PERSON = (
    "stature", "mass", "sitting_height", "arm_length", "shoulder_breadth", "hip_breadth",
)  # fmt: skip
"""Stature [m], mass [kg], and dimensions [m] of :data:`manikin.body.dimensions.DIMENSIONS`."""

_SURVEYED = (
    "stature", "mass", "sitting_height", "upper_arm", "forearm", "shoulder_breadth", "hip_breadth",
)  # fmt: skip
"""Of the survey: upper arm and forearm from acromion to radiale to stylion, biacromial and hip breadth."""

# By sex and measure: mean, standard deviation, smallest and largest [mm, kg].
_STATISTICS = {
    Sex.MALE: (
        (1756.21, 68.55, 1491.0, 1993.0), (85.52, 14.22, 39.3, 144.2), (918.29, 35.70, 790.0, 1039.0),
        (335.24, 17.48, 270.0, 393.0), (267.88, 15.42, 216.0, 328.0), (415.68, 19.16, 337.0, 489.0),
        (345.73, 24.17, 264.0, 452.0),
    ),
    Sex.FEMALE: (
        (1628.47, 64.20, 1409.0, 1829.0), (67.76, 10.98, 35.8, 119.6), (856.63, 33.05, 750.0, 953.0),
        (311.20, 17.16, 249.0, 371.0), (241.33, 15.24, 169.0, 297.0), (365.35, 18.30, 283.0, 422.0),
        (353.84, 26.67, 276.0, 473.0),
    ),
}  # fmt: skip
# Correlations above the diagonal, row by row.
_CORRELATIONS = {
    Sex.MALE: (
        (0.469, 0.779, 0.795, 0.715, 0.532, 0.383), (0.405, 0.420, 0.347, 0.588, 0.848),
        (0.474, 0.323, 0.432, 0.397), (0.719, 0.471, 0.329), (0.449, 0.244), (0.474,),
    ),
    Sex.FEMALE: (
        (0.533, 0.764, 0.793, 0.687, 0.566, 0.387), (0.406, 0.511, 0.428, 0.457, 0.828),
        (0.451, 0.266, 0.427, 0.382), (0.687, 0.472, 0.365), (0.495, 0.225), (0.301,),
    ),
}  # fmt: skip
_UNITS = np.array([1e-3, 1.0, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3])
_ARM = np.array([
    [1, 0, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0, 0], [0, 0, 0, 1, 1, 0, 0],
    [0, 0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 0, 1],
], float)  # fmt: skip
"""(6, 7): the arm from acromion to stylion is the sum of its two parts."""


@dataclass(frozen=True, eq=False)
class PopulationStatistics:
    """Statistics of one sex, by :data:`MEASURES_OF_A_PERSON` [m, kg].

    Attributes:
        mean: (6,).
        covariance: (6, 6).
        least: (6,), smallest values of the survey, of the arm the sum of those of its parts.
        largest: (6,), largest values likewise.
    """

    mean: FloatArray
    covariance: FloatArray
    least: FloatArray
    largest: FloatArray

    @property
    def deviation(self) -> FloatArray:
        """(6,) standard deviations."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, eq=False)
class PersonOfPopulation:
    """One person.

    Attributes:
        name: Unique among those made by one call, such as ``female-P5``.
        sex: Whose statistics.
        values: (6,), by :data:`MEASURES_OF_A_PERSON` [m, kg].
        drawn: Whether it is a random draw, which stands for a share of the population.
    """

    name: str
    sex: Sex
    values: FloatArray
    drawn: bool = False

    def body_keys(self) -> dict[str, float | str]:
        """Keys of a scenario's ``body``, rounded to 0.1 mm and 10 g."""
        sizes = dict(zip(MEASURES_OF_A_PERSON, self.values.tolist(), strict=True))
        mass = round(sizes.pop("mass"), 2)
        return {"sex": str(self.sex), "mass_kg": mass, **{f"{k}_m": round(v, 4) for k, v in sizes.items()}}


@cache
def population_statistics(sex: Sex) -> PopulationStatistics:
    """Published statistics of a sex.

    The length of the arm has the mean and covariance of the sum of its two parts.
    """
    mean, deviation, least, largest = (_UNITS * column for column in np.array(_STATISTICS[sex]).T)
    upper = np.zeros((len(_SURVEYED), len(_SURVEYED)))
    upper[np.triu_indices_from(upper, 1)] = [value for row in _CORRELATIONS[sex] for value in row]
    correlation = np.eye(len(_SURVEYED)) + upper + upper.T
    covariance = _ARM @ (correlation * np.outer(deviation, deviation)) @ _ARM.T
    values = ((_ARM @ mean, "mean"), (_ARM @ least, "least"), (_ARM @ largest, "largest"))
    fixed = {name: frozen_array(value, name, (6,)) for value, name in values}
    return PopulationStatistics(covariance=frozen_array(covariance, "covariance", (6, 6)), **fixed)


def boundary_people(
    sex: Sex, share: float, measures: Sequence[str] = MEASURES_OF_A_PERSON, *, corners: bool = False
) -> tuple[PersonOfPopulation, ...]:
    """People on the surface of the ellipsoid that holds a share of a sex.

    They are the two ends of each of its k axes, and with ``corners`` also the 2 to the k points
    between these, where the axes count alike. Axes are the principal components of the correlations, the one
    with the largest variance first. Measures that are not named have their mean given those that are.

    Args:
        sex: Whose statistics.
        share: Of the people inside of the ellipsoid, above 0 and at most 0.999.
        measures: Of :data:`MEASURES_OF_A_PERSON`, at least one.
        corners: Whether to add the points between the axes.

    Raises:
        BodyError: If the share is out of range, or a measure is unknown.
    """
    share = finite_number(share, "share of the people", above=0.0, at_most=0.999, error=BodyError)
    known, chosen = population_statistics(sex), _numbers(measures)
    deviation, count = known.deviation[chosen], len(chosen)
    variances, axes = _components(known, chosen)
    names, directions = [], []
    for number, row in enumerate(np.eye(count)):
        names += [f"axis{number + 1}+", f"axis{number + 1}-"]
        directions += [row, -row]
    for signs in product((1.0, -1.0), repeat=count) if corners and count > 1 else ():
        names.append("corner" + "".join("+" if sign > 0 else "-" for sign in signs))
        directions.append(np.array(signs) / np.sqrt(count))
    steps = np.sqrt(chdtri(count, 1.0 - share) * variances) * np.array(directions)
    people = _completed(known, chosen, (steps @ axes.T) * deviation)
    return tuple(
        PersonOfPopulation(f"{sex}-{name}", sex, row) for name, row in zip(names, people, strict=True)
    )


def percentile_person(sex: Sex, percent: float) -> PersonOfPopulation:
    """The person whose stature and mass are at a percentile, and whose other measures are the mean for these.

    Args:
        sex: Whose statistics.
        percent: Percentile of both, between 0.1 and 99.9; of the normal distribution.

    Raises:
        BodyError: If the percentile is out of range.
    """
    percent = finite_number(percent, "percentile", at_least=0.1, at_most=99.9, error=BodyError)
    known, chosen = population_statistics(sex), _numbers(("stature", "mass"))
    off = ndtri(percent / 100.0) * known.deviation[chosen]
    return PersonOfPopulation(f"{sex}-P{percent:g}", sex, _completed(known, chosen, off[None])[0])


def random_people(sex: Sex, count: int, seed: int) -> tuple[PersonOfPopulation, ...]:
    """Random draws that fill the population evenly; the first ones are the same whatever the count.

    They are the points of a scrambled Sobol sequence, along the principal components of the correlations:
    shares of people that they estimate are off by about half as much as those of independent draws. A point
    of which a measure is beyond all people of the survey is left out: 0.2 % of men, 0.7 % of women.

    Args:
        sex: Whose statistics.
        count: How many.
        seed: Of the draws.
    """
    known = population_statistics(sex)
    generator, size = np.random.default_rng((seed, list(Sex).index(sex))), len(known.mean)
    variances, axes = _components(known, range(size))
    points = MultivariateNormalQMC(np.zeros(size), engine=Sobol(size, rng=generator))
    people: list[PersonOfPopulation] = []
    while len(people) < count:
        for point in points.random(BLOCK):
            values = known.mean + known.deviation * (axes @ (np.sqrt(variances) * point))
            if np.all((known.least <= values) & (values <= known.largest)):
                name = f"{sex}-draw{seed}-{len(people)}"
                people.append(PersonOfPopulation(name, sex, frozen_array(values, "person", (6,)), drawn=True))
    return tuple(people[:count])


BLOCK = 64
"""Points of a sequence that are made at once; a power of two."""


def _components(known: PopulationStatistics, chosen: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """(k,) variances of the principal components of the correlations of k measures, and their (k, k) axes.

    The largest comes first. The sign of an eigenvector is left open: its largest component is positive, of
    equal ones the first.
    """
    deviation = known.deviation[chosen]
    covariance = known.covariance[np.ix_(chosen, chosen)]
    variances, axes = np.linalg.eigh(covariance / np.outer(deviation, deviation))
    variances, axes = variances[::-1], axes[:, ::-1]
    largest = np.abs(axes).round(6).argmax(axis=0)
    return variances, axes * np.sign(axes[largest, np.arange(len(chosen))])


def _numbers(measures: Sequence[str]) -> list[int]:
    """Indices of measures, in their own order."""
    unknown = set(measures) - set(MEASURES_OF_A_PERSON)
    if unknown or not measures:
        problem = f"measure is {min(unknown)!r}" if unknown else "measures are empty"
        raise BodyError(f"{problem}; valid: {', '.join(MEASURES_OF_A_PERSON)}")
    return [number for number, name in enumerate(MEASURES_OF_A_PERSON) if name in measures]


def _completed(known: PopulationStatistics, chosen: list[int], off: FloatArray) -> list[FloatArray]:
    """People whose chosen measures are ``off`` (n, k) the mean, and the others as expected of these."""
    gain = np.linalg.solve(known.covariance[np.ix_(chosen, chosen)], known.covariance[chosen])
    gain[:, chosen] = np.eye(len(chosen))
    return [frozen_array(known.mean + row @ gain, "person", (6,)) for row in off]
