"""Roadmaps in files, to be used again for the same scene, creature and condition."""

from pathlib import Path

import networkx as nx
import numpy as np

from manikin.atomic import atomic_path
from manikin.errors import InputError
from manikin.reachability.guide import World, offline_roadmap
from manikin.reachability.roadmap import Roadmap
from manikin.reachability.steering import Way

FORMAT = "manikin-roadmap-1"
_STRAIGHT = -1.0  # stands for "no turn on the spot" in the file


def save_roadmap(path: str | Path, roadmap: Roadmap, world: World) -> None:
    """Write a roadmap and the digest of its world into a NumPy archive (``.npz``).

    Raises:
        OSError: If the folder cannot be written to.
    """
    edges = sorted((min(edge), max(edge)) for edge in roadmap.graph.edges)
    turns = [roadmap.way(a, b).turn_at for a, b in edges]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            format=np.array(FORMAT),
            key=np.array(world.key),
            poses=roadmap.poses,
            guard=np.array([roadmap.graph.nodes[node]["guard"] for node in range(len(roadmap.poses))], bool),
            edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
            turn_at=np.array([_STRAIGHT if turn is None else turn for turn in turns], dtype=np.float64),
            counts=np.array([roadmap.samples, roadmap.rejected]),
        )


def load_roadmap(path: str | Path, world: World) -> Roadmap | None:
    """Read a roadmap back.

    Args:
        path: File written by :func:`save_roadmap`.
        world: What it should be about.

    Returns:
        None if the file is about another scene, creature, condition or setting.

    Raises:
        InputError: If the file is missing or holds no roadmap.
    """
    file = Path(path)
    try:
        with np.load(file, allow_pickle=False) as archive:
            values = {name: archive[name] for name in archive.files}
        if str(values["format"]) != FORMAT:
            raise ValueError(f"format {values['format']}")
        if str(values["key"]) != world.key:
            return None
        return _roadmap(world, values)
    except FileNotFoundError:
        raise InputError(f"roadmap file '{file}' does not exist; valid: a file of save_roadmap") from None
    except (OSError, ValueError, KeyError, EOFError) as error:
        reason = " ".join(str(error).split())[:100]
        raise InputError(
            f"roadmap file '{file}' cannot be read ({reason}); valid: a file of save_roadmap"
        ) from None


def roadmap_for(path: str | Path, world: World, rng: np.random.Generator) -> Roadmap:
    """Roadmap of a world from its file, or made now and written there.

    A file about another world is replaced.

    Raises:
        InputError: If the file exists and holds no roadmap.
        OSError: If the folder cannot be written to.
    """
    found = load_roadmap(path, world) if Path(path).exists() else None
    if found is None:
        found = offline_roadmap(world, rng)
        save_roadmap(path, found, world)
    return found


def _roadmap(world: World, values: dict[str, np.ndarray]) -> Roadmap:
    roadmap = Roadmap(world.settings.roadmap, nx.Graph())
    for pose, guard in zip(values["poses"], values["guard"], strict=True):
        roadmap.add(pose, guard=bool(guard))
    for (first, second), turn in zip(values["edges"], values["turn_at"], strict=True):
        way = Way(None if turn == _STRAIGHT else float(turn))
        roadmap.join(int(first), int(second), way)
    roadmap.samples, roadmap.rejected = (int(count) for count in values["counts"])
    return roadmap
