"""Where a function on the vertices of tetrahedra changes its sign, as a surface of triangles."""

from itertools import combinations, permutations

import numpy as np


def _cases() -> dict[int, list[list[tuple[int, int]]]]:
    """By the corners where the function is positive, a bit each: triangles of crossed edges, facing the negative."""
    cases = {}
    for i in range(4):
        j, k, m = i ^ 1, i ^ 2, i ^ 3  # an even permutation, as those below
        cases[1 << i] = [[(i, j), (i, k), (i, m)]]
        cases[15 - (1 << i)] = [[(i, j), (i, m), (i, k)]]
    for i, j, k, m in ((0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 2, 0), (2, 3, 0, 1)):
        cases[1 << i | 1 << j] = [[(i, k), (i, m), (j, m)], [(i, k), (j, m), (j, k)]]
    return cases


CASES = _cases()


def isosurface(tetrahedra: np.ndarray, positive: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Marching tetrahedra: the edges that cross from positive to negative, and triangles between the crossings.

    tetrahedra: (K, 4) indices of nodes, positively oriented, sharing whole faces; positive:
    (N,) whether the function is positive at each node. Returns edges (E, 2) of nodes and
    triangles (F, 3) of edges that face the negative side. The surface is a manifold whose
    boundary lies in the boundary of the tetrahedra. Source: Doi and Koide 1991.
    """
    bits = positive[tetrahedra] @ [1, 2, 4, 8]
    corners = [np.empty((0, 3, 2), dtype=np.intp)]
    for case, triangles in CASES.items():
        chosen = tetrahedra[bits == case]
        corners += [chosen[:, np.array(triangle)] for triangle in triangles]
    pairs = np.sort(np.concatenate(corners), axis=2)
    keys, inverse = np.unique(pairs @ [len(positive), 1], return_inverse=True)
    edges = np.column_stack(np.divmod(keys, len(positive)))
    return edges, inverse.reshape(-1, 3)


def prisms(triangles: np.ndarray, positive: np.ndarray) -> np.ndarray:
    """(K, 4) tetrahedra of the prisms between layers of a triangulated surface that the function's sign changes in.

    triangles: (F, 3) of nodes 0 … n − 1; positive: (layers, n), node i of layer k having the
    number k · n + i. Every side of a prism is cut from its lower corner of smaller number, so
    that neighbours fit.
    """
    nodes = positive.shape[1]
    order = np.argsort(triangles, axis=1)
    # The even permutations of three, read as numbers to base 3.
    even = np.isin(order @ [9, 3, 1], [5, 15, 19])
    ordered = np.sort(triangles, axis=1)
    count = positive[:, ordered].sum(axis=2)
    count = count[:-1] + count[1:]
    layer, triangle = np.nonzero((count > 0) & (count < 6))
    a, b, c = (layer[:, None] * nodes + ordered[triangle]).T
    x, y, z = (i + nodes for i in (a, b, c))
    lower, middle, upper = np.stack([a, b, c, z], 1), np.stack([a, y, b, z], 1), np.stack([a, x, y, z], 1)
    tetrahedra = np.concatenate([lower, middle, upper])
    odd = ~np.tile(even[triangle], 3)
    tetrahedra[odd] = tetrahedra[odd][:, [1, 0, 2, 3]]
    return tetrahedra


def cubes(positive: np.ndarray) -> np.ndarray:
    """(K, 4) tetrahedra, six a cube (Kuhn), of a grid's cubes that the function's sign changes in.

    positive: (nx, ny, nz); nodes are numbered as in its `ravel`.
    """
    strides = np.array([positive.shape[1] * positive.shape[2], positive.shape[2], 1])
    index = np.arange(positive.size).reshape(positive.shape)[:-1, :-1, :-1].ravel()
    steps = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) @ strides
    count = positive.ravel()[index[:, None] + steps].sum(axis=1)
    base = index[(count > 0) & (count < 8)]
    parts = []
    for axes in permutations(range(3)):
        corners = base[:, None] + np.concatenate([[0], np.cumsum(strides[list(axes)])])
        odd = np.linalg.det(np.eye(3)[list(axes)]) < 0
        parts.append(corners[:, [1, 0, 2, 3]] if odd else corners)
    return np.concatenate(parts)


def sphere(divisions: int) -> tuple[np.ndarray, np.ndarray]:
    """A triangulated unit sphere: the faces of an icosahedron in divisions² triangles each, facing outwards.

    Returns vertices (10 n² + 2, 3) and triangles (20 n², 3) for n divisions. The icosahedron
    stands askew: great circles of simple directions would else run through rows of vertices.
    """
    from scipy.spatial.transform import Rotation  # here, since it is a fifth of the time of `import symmotion`

    n, golden = divisions, (1 + np.sqrt(5)) / 2
    corners = np.array([np.roll([0, y, z * golden], k) for k in range(3) for y in (-1, 1) for z in (-1, 1)])
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    faces = [f for f in combinations(range(12), 3) if all(near[i, j] for i, j in combinations(f, 2))]
    # A face's grid by integer weights that add up to n.
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    i, j = i[i + j <= n], j[i + j <= n]
    number = np.full((n + 2, n + 2), -1)
    number[i, j] = np.arange(len(i))
    up = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)
    down = np.stack([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]], axis=1)
    cells = np.concatenate([up, down])
    cells = cells[(cells >= 0).all(axis=1)]
    weights = np.column_stack([i, j, n - i - j])
    points, triangles = [], []
    for k, face in enumerate(faces):
        a, b, c = corners[list(face)]
        turned = np.dot(a, np.cross(b, c)) < 0
        triangles.append((cells[:, ::-1] if turned else cells) + k * len(i))
        points.append(weights @ np.stack([a, b, c]) / n)
    flat = np.concatenate(points)
    # Faces share the nodes of their edges: the same point up to rounding.
    _, first, inverse = np.unique(flat.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    vertices = Rotation.from_rotvec([0.3, 0.5, 0.7]).apply(flat[first])
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), inverse.ravel()[np.concatenate(triangles)]
