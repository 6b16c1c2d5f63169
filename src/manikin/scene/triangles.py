"""Triangles as a Coal hierarchy, and fewer triangles at nearly the same place."""

import coal
import fast_simplification
import numpy as np
from numpy.typing import NDArray

import manikin.runtime.coal_workarounds  # noqa: F401  (before the first distance)
from manikin.numerics.spatial import FloatArray

IntArray = NDArray[np.int64]

_SAMPLES = 5000
"""Vertices whose distance from the fewer triangles is measured."""


def decimated(vertices: FloatArray, faces: IntArray, count: int) -> tuple[FloatArray, IntArray, float]:
    """Fewer triangles by quadric error metrics ([Garland1997]_).

    Args:
        vertices: (n, 3) without coincident ones [m].
        faces: (m, 3).
        count: Triangles to keep.

    Returns:
        Vertices, faces, and the largest distance of 5000 of the given vertices from them [m].

    .. [Garland1997] M. Garland, P. Heckbert, Surface simplification using quadric error metrics, SIGGRAPH
       1997.
    """
    # In single precision about the middle, where that is a ten-millionth of the size.
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    centred = (vertices - middle).astype(np.float32)
    kept, triangles, *_ = fast_simplification.simplify(centred, faces.astype(np.int32), target_count=count)
    fewer, left = np.asarray(kept, dtype=np.float64) + middle, np.asarray(triangles, dtype=np.int64)
    samples = vertices[:: max(1, len(vertices) // _SAMPLES)]
    return fewer, left, _largest_distance(samples, fewer, left)


def _largest_distance(points: FloatArray, vertices: FloatArray, faces: IntArray) -> float:
    """Largest distance of points (k, 3) from a surface [m]."""
    surface, here = triangle_geometry(vertices, faces), coal.Transform3s.Identity()
    point, request = coal.Sphere(1e-9), coal.DistanceRequest()
    return max(
        float(
            coal.distance(
                surface, here, point, coal.Transform3s(np.eye(3), at), request, coal.DistanceResult()
            )
        )
        for at in points
    )


def triangle_geometry(vertices: FloatArray, faces: IntArray) -> coal.CollisionGeometry:
    """Coal bounding-volume hierarchy over triangles."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(coal_vertices(vertices), coal_triangles(faces))
    model.endModel()
    model.computeLocalAABB()
    return model


def coal_vertices(vertices: FloatArray) -> coal.StdVec_Vec3s:
    """Vertices (n, 3) as Coal takes them."""
    out = coal.StdVec_Vec3s()
    out.extend([np.asarray(vertex, dtype=np.float64) for vertex in vertices])
    return out


def coal_triangles(faces: IntArray) -> coal.StdVec_Triangle:
    """Faces (m, 3) as Coal takes them."""
    out = coal.StdVec_Triangle()
    out.extend([coal.Triangle(int(a), int(b), int(c)) for a, b, c in faces])
    return out
