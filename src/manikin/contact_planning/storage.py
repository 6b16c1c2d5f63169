"""Samples of limbs in files, to be used again for the same body."""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from manikin.atomic import atomic_path
from manikin.body import BodyModel, limb_named
from manikin.body.limbs import limb_slots, parent_segment
from manikin.contact_planning.samples import THRESHOLD, LimbSamples, mirrored, sample_limbs, samples_of
from manikin.errors import BodyError
from manikin.motion.description import body_key

FORMAT = "manikin-samples-1"
_ARRAYS = ("origin", "angles", "positions", "rotations", "products")


def save_samples(path: str | Path, samples: Mapping[str, LimbSamples], body: BodyModel) -> None:
    """Write the samples of a body's limbs and the digest of the body into a NumPy archive (``.npz``).

    Limbs that share their samples with their reflection share them in the file.

    Args:
        path: Where to; its folder must exist. An interruption leaves the old file or none.
        samples: By name of the limb, of :func:`manikin.contact_planning.sample_limbs`.
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

    The arguments are those of :func:`manikin.contact_planning.sample_limbs`; a file that exists is taken as
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
