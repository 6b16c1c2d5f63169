"""Sampled configurations of a limb, made once and asked often ([Tonneau2015]_ 5.1.4, 5.3.1).

Also here. Samples of limbs in files, to be used again for the same body.
"""

import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, Limb, are_mirrored, limb_named
from manikin.body.limbs import REFLECTION, limb_origin, limb_slots, parent_segment
from manikin.body.natural_range import NaturalRange
from manikin.errors import BodyError
from manikin.kinematics import LimbKinematics, ReachVolume
from manikin.kinematics.limb_kinematics import hull_of, rigid_reach
from manikin.motion.description import body_key
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.runtime.files import atomic_path

THRESHOLD = 0.05
"""Smallest manipulability, as a share of the largest one seen; our choice, the thesis leaves it open."""
_FEWEST_KEPT = 0.02


@dataclass(frozen=True, eq=False)
class LimbSamples:
    """Random configurations of one limb, in the limb's frame.

    Attributes:
        limb: The limb.
        segment: Name of the segment that carries it.
        origin: (3,) origin of the limb's frame in that segment [m].
        angles: (n, k) joint angles [rad].
        positions: (n, 3) effector positions [m].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        products: (n, 3, 3) ``J J^T`` of the effector's translation [m^2].
        threshold: Manipulability [m^3] that every sample has at least.
        natural: Whether hips and shoulders keep to learnt volumes; contacts made of the samples do then too.
    """

    limb: Limb
    segment: str
    origin: FloatArray
    angles: FloatArray
    positions: FloatArray
    rotations: FloatArray
    products: FloatArray
    threshold: float
    natural: bool = False

    def __post_init__(self) -> None:
        for name in ("origin", "angles", "positions", "rotations", "products"):
            getattr(self, name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.angles)

    @cached_property
    def manipulability(self) -> FloatArray:
        """(n,) ``sqrt(det(J J^T))`` [m^3] (5.6, where the print lacks the determinant)."""
        return manipulability(self.products)

    @cached_property
    def upward(self) -> FloatArray:
        """(n, 3) z axes of the effector, the normals it would fit, in the limb's frame."""
        return np.ascontiguousarray(self.rotations[:, :, 2])

    @cached_property
    def hull(self) -> tuple[FloatArray, float]:
        """Corners (h, 3) of the reach in the limb's frame, and the largest distance of one [m]."""
        corners = self.reach.vertices - self.origin
        return corners, float(np.linalg.norm(corners, axis=1).max())

    @cached_property
    def reach(self) -> ReachVolume:
        """Convex hull of the positions in the frame of the carrying segment; without joints a small cube."""
        if not self.angles.shape[1]:
            return rigid_reach(self.limb, self.segment, self.positions[0] + self.origin, self.rotations[0])
        return hull_of(self.limb, self.segment, self.positions + self.origin)


def manipulability(products: FloatArray) -> FloatArray:
    """(n,) ``w = sqrt(det(J J^T))`` of (n, 3, 3) products ([Tonneau2015]_ 5.6)."""
    a, b, c = products[:, :, 0], products[:, :, 1], products[:, :, 2]
    determinant = (
        a[:, 0] * (b[:, 1] * c[:, 2] - b[:, 2] * c[:, 1])
        - b[:, 0] * (a[:, 1] * c[:, 2] - a[:, 2] * c[:, 1])
        + c[:, 0] * (a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1])
    )
    return np.sqrt(np.maximum(determinant, 0.0))


def sample_limb(
    body: BodyModel,
    limb: Limb,
    rng: np.random.Generator,
    count: int = 10_000,
    threshold: float = THRESHOLD,
    *,
    natural: bool = False,
) -> LimbSamples:
    """Draw configurations of a limb within its range of motion and keep those far from singular.

    The ratio that EFORT builds on grows without bound towards singular configurations, so those with
    little manipulability are dropped (5.4.1).  A limb without joints has one configuration, which is kept.

    Args:
        body: The body.
        limb: One of its limbs.
        rng: Source of randomness.
        count: Number of samples that are kept, > 0.
        threshold: Smallest manipulability kept, as a share of the largest among the first
            ``count`` samples, in [0, 1).
        natural: Whether hips and shoulders of the human keep to their learnt volumes (4.3.3) and not
            to the intervals of their hinges alone; of no effect on other limbs. Off unless asked for:
            the recordings hold no movement of the largest amplitude, and climbing needs more.

    Raises:
        BodyError: If a value is out of its range, or fewer than one sample in fifty passes.
    """
    if count < 4:
        raise BodyError(f"limb samples count is {count}; valid: at least 4")
    share = finite_number(threshold, "limb samples threshold", at_least=0.0, error=BodyError)
    count = samples_of(body, limb, count)
    chain = LimbKinematics(body, limb)
    angles_of = _source(body, limb, chain, rng, natural)
    parts: list[tuple[FloatArray, ...]] = []
    kept, drawn, least = 0, 0, None
    while kept < count:
        part, values = _placed(chain, angles_of(count))
        least = share * float(values.max()) if least is None else least
        good = values >= least
        parts.append(tuple(values[good] for values in part))
        kept, drawn = kept + int(good.sum()), drawn + count
        if kept < _FEWEST_KEPT * drawn:
            raise BodyError(
                f"limb {limb.name!r}: {kept} of {drawn} samples have a manipulability of {share:g} of the "
                "largest; valid: a smaller threshold"
            )
    joined = [np.concatenate(arrays)[:count] for arrays in zip(*parts, strict=True)]
    origin = limb_origin(body, limb)
    return LimbSamples(
        limb, parent_segment(body, limb), origin, *joined, threshold=float(least or 0.0), natural=natural
    )


def samples_of(body: BodyModel, limb: Limb, count: int) -> int:
    """Number of samples that there are of a limb where ``count`` are asked for: without joints, one."""
    return count if len(limb_slots(body, limb)) else 1


def _source(
    body: BodyModel, limb: Limb, chain: LimbKinematics, rng: np.random.Generator, natural: bool
) -> Callable[[int], FloatArray]:
    """What draws (count, k) joint angles."""
    volumes = NaturalRange(body, limb)
    if natural and volumes.learnt:
        return lambda count: volumes.random_angles(rng, count)
    return lambda count: chain.random_angles(rng, count)


def _placed(chain: LimbKinematics, angles: FloatArray) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Angles, positions, rotations, products; and the manipulabilities."""
    placed = chain.place(angles)
    products = placed.jacobians @ placed.jacobians.transpose(0, 2, 1)
    return (angles, placed.positions, placed.rotations, products), manipulability(products)


def mirrored(body: BodyModel, samples: LimbSamples, limb: Limb) -> LimbSamples:
    """Samples of the limb on the other side, by reflection in the sagittal plane (5.3.1).

    Equal angles give ``M p``, ``M R M`` and ``M J J^T M`` with ``M = diag(1, -1, 1)``.

    Args:
        body: The body.
        samples: Samples of a limb.
        limb: The limb that is its mirror image.

    Raises:
        BodyError: If it is not.
    """
    if not are_mirrored(body, samples.limb, limb):
        raise BodyError(
            f"limb {limb.name!r} is no reflection of {samples.limb.name!r}; "
            f"valid: {samples.limb.mirror or 'none'}"
        )
    flip: NDArray[np.float64] = np.outer(REFLECTION, REFLECTION)
    return LimbSamples(
        limb,
        samples.segment,
        samples.origin * REFLECTION,
        samples.angles,
        samples.positions * REFLECTION,
        samples.rotations * flip,
        samples.products * flip,
        samples.threshold,
        samples.natural,
    )


def sample_limbs(
    body: BodyModel,
    rng: np.random.Generator,
    count: int = 10_000,
    threshold: float = THRESHOLD,
    *,
    natural: bool = False,
) -> dict[str, LimbSamples]:
    """Samples of every limb by its name; mirrored limbs share one set, reflected.

    Args:
        body: A body with limbs.
        rng: Source of randomness.
        count: Samples per limb.
        threshold: See :func:`sample_limb`.
        natural: See :func:`sample_limb`.
    """
    found: dict[str, LimbSamples] = {}
    for limb in body.limbs:
        twin = found.get(limb.mirror or "")
        if twin is not None and are_mirrored(body, twin.limb, limb):
            found[limb.name] = mirrored(body, twin, limb)
        else:
            found[limb.name] = sample_limb(body, limb, rng, count, threshold, natural=natural)
    return found


FORMAT = "manikin-samples-1"
_ARRAYS = ("origin", "angles", "positions", "rotations", "products")


def save_samples(path: str | Path, samples: Mapping[str, LimbSamples], body: BodyModel) -> None:
    """Write the samples of a body's limbs and the digest of the body into a NumPy archive (``.npz``).

    Limbs that share their samples with their reflection share them in the file.

    Args:
        path: Where to; its folder must exist. An interruption leaves the old file or none.
        samples: By name of the limb, of :func:`manikin.planning.contacts.sample_limbs`.
        body: Whose they are.

    Raises:
        BodyError: If the body has no such limb.
        OSError: If the folder cannot be written to.
    """
    arrays: dict[str, Any] = {}
    limbs: dict[str, dict[str, Any]] = {}
    for name, item in samples.items():
        _check_limb(body, name, item)
        twin = next((key for key in limbs if samples[key].angles is item.angles), None)
        limbs[name] = {"twin": twin, "threshold": item.threshold, "natural": item.natural}
        if twin is None:
            arrays |= {f"{name}/{key}": getattr(item, key) for key in _ARRAYS}
    head = {"format": FORMAT, "body": body.name, "key": body_key(body), "limbs": limbs}
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, head=np.array(json.dumps(head)), **arrays)


def load_samples(path: str | Path, body: BodyModel) -> dict[str, LimbSamples]:
    """Read samples back, bit for bit.

    Args:
        path: File written by :func:`save_samples`.
        body: Whose they should be.

    Raises:
        BodyError: If the file is missing, holds no samples, or those of another body.
    """
    file = Path(path)
    try:
        with np.load(file, allow_pickle=False) as archive:
            head = json.loads(str(archive["head"]))
            if head["format"] != FORMAT:
                raise ValueError(f"format {head['format']}")
            _check_body(file, head, body)
            return _samples(archive, head["limbs"], body)
    except BodyError:
        raise
    except FileNotFoundError:
        raise BodyError(f"samples file '{file}' does not exist; valid: a file of save_samples") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split())[:100]
        raise BodyError(
            f"samples file '{file}' cannot be read ({reason}); valid: a file of save_samples"
        ) from None


def samples_for(
    path: str | Path,
    body: BodyModel,
    rng: np.random.Generator,
    count: int = 10_000,
    threshold: float = THRESHOLD,
    *,
    natural: bool = False,
) -> dict[str, LimbSamples]:
    """Samples of a body from their file, or made now and written there.

    The arguments are those of :func:`manikin.planning.contacts.sample_limbs`; a file that exists is taken as
    it is, whatever its threshold and seed.

    Raises:
        BodyError: If the file exists and holds other than ``count`` samples of each limb of this body,
            natural or not as asked for.
        OSError: If the folder cannot be written to.
    """
    if not Path(path).exists():
        made = sample_limbs(body, rng, count, threshold, natural=natural)
        save_samples(path, made, body)
        return made
    found = load_samples(path, body)
    wanted = {limb.name: (samples_of(body, limb, count), natural) for limb in body.limbs}
    held = {name: (len(item), item.natural) for name, item in found.items()}
    if held != wanted:
        raise BodyError(f"samples file '{path}' holds {_words(held)}; valid: {_words(wanted)}, or a new file")
    return found


def _words(held: Mapping[str, tuple[int, bool]]) -> str:
    kinds = sorted({f"{count} {'natural ' if natural else ''}samples" for count, natural in held.values()})
    return f"{' and '.join(kinds) or 'no samples'} of {', '.join(held) or 'no limb'}"


def _check_limb(body: BodyModel, name: str, samples: LimbSamples) -> None:
    limb = limb_named(body, name)
    if samples.limb != limb or samples.angles.shape[1] != len(limb_slots(body, limb)):
        raise BodyError(f"samples of {name!r} are not of this body's limb; valid: samples made of this body")


def _check_body(file: Path, head: Mapping[str, Any], body: BodyModel) -> None:
    if head["key"] != body_key(body):
        raise BodyError(
            f"samples file '{file}' is about another body ({str(head['body'])[:60]!r} of other dimensions, "
            f"joints or limbs); valid: samples of this {body.name!r}, or a new file"
        )


def _samples(archive: Any, limbs: Mapping[str, Mapping[str, Any]], body: BodyModel) -> dict[str, LimbSamples]:
    found: dict[str, LimbSamples] = {}
    for name, about in limbs.items():
        limb = limb_named(body, name)
        if about["twin"] is not None:
            found[name] = mirrored(body, found[about["twin"]], limb)
            continue
        arrays = [np.asarray(archive[f"{name}/{key}"], dtype=np.float64) for key in _ARRAYS]
        n, k = len(arrays[1]), len(limb_slots(body, limb))
        shapes = [(3,), (n, k), (n, 3), (n, 3, 3), (n, 3, 3)]
        if [array.shape for array in arrays] != shapes or not all(np.isfinite(a).all() for a in arrays):
            raise ValueError(f"samples of {name!r} are damaged")
        found[name] = LimbSamples(
            limb,
            parent_segment(body, limb),
            *arrays,
            threshold=float(about["threshold"]),
            natural=bool(about["natural"]),
        )
    return found
