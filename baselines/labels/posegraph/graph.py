"""Pose graphs: nodes are camera poses, edges are measured motions between two of them.

Files are ``.g2o`` text with the records ``VERTEX_SE3:QUAT id x y z qx qy qz qw`` and
``EDGE_SE3:QUAT i j x y z qx qy qz qw`` followed by the upper triangle of the 6x6 information
matrix, row by row. The information is translation first (per square metre), then rotation (per
square radian of the rotation vector), here and in the files. gtsam and Open3D put the rotation
first: see :func:`swapped_blocks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import check_unit, whole_numbers
from synfeal.errors import InputError, why
from synfeal.geometry.poses import inverse, pose_from_quat, quat_wxyz_of, relative
from synfeal.records.files import atomic_path, read_text

Array = NDArray[np.float64]

_VERTEX, _EDGE = "VERTEX_SE3:QUAT", "EDGE_SE3:QUAT"
_UPPER = np.triu_indices(6)
_CELLS = {_VERTEX: 8, _EDGE: 2 + 7 + len(_UPPER[0])}


@dataclass(frozen=True)
class Edge:
    """A measured motion.

    Attributes:
        i: Node the motion starts from.
        j: Node it leads to.
        i_from_j: Measured pose (4, 4) of node j in the frame of node i.
        information: Inverse covariance (6, 6), translation first.
    """

    i: int
    j: int
    i_from_j: Array
    information: Array


@dataclass(frozen=True)
class PoseGraph:
    """A batch as a graph.

    Attributes:
        first_from_cam: Initial poses (n, 4, 4) relative to node 0.
        edges: Measured motions.
    """

    first_from_cam: Array
    edges: tuple[Edge, ...]

    def __len__(self) -> int:
        return len(self.first_from_cam)


def edge_residuals(graph: PoseGraph, first_from_cam: Array) -> Array:
    """Compute residuals (n_edges, 6) at poses (n, 4, 4): translation (m), rotation vector (rad).

    They are those of ``inverse(measured) @ predicted``, zero where the poses agree with the edge.
    """
    i = np.array([edge.i for edge in graph.edges])
    j = np.array([edge.j for edge in graph.edges])
    measured = np.array([edge.i_from_j for edge in graph.edges])
    error = inverse(measured) @ relative(first_from_cam[i], first_from_cam[j])
    return np.hstack([error[:, :3, 3], Rotation.from_matrix(error[:, :3, :3]).as_rotvec()])


def chi2(graph: PoseGraph, first_from_cam: Array) -> float:
    """Sum over the edges of ``residual @ information @ residual`` at poses (n, 4, 4)."""
    residuals = edge_residuals(graph, first_from_cam)
    information = np.array([edge.information for edge in graph.edges])
    return float(np.einsum("ei,eij,ej->", residuals, information, residuals))


def check_connected(graph: PoseGraph) -> None:
    """Refuse a graph with nodes that no chain of edges joins to node 0: their poses are unknown.

    Raises:
        ValueError: naming the first such node.
    """
    ends = np.array([(edge.i, edge.j) for edge in graph.edges], dtype=np.int64).reshape(-1, 2)
    links = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(graph),) * 2)
    _, group = connected_components(links, directed=False)
    apart = np.flatnonzero(group != group[0])
    if len(apart):
        raise ValueError(f"node {apart[0]} is not connected to node 0 by edges")


def swapped_blocks(information: Array) -> Array:
    """Return the (6, 6) matrix with translation and rotation exchanged; its own inverse."""
    order = [3, 4, 5, 0, 1, 2]
    return information[np.ix_(order, order)]


def write_g2o(path: Path, graph: PoseGraph) -> None:
    """Write the graph as g2o text with enough digits to read back the same values."""
    lines = [
        " ".join([_VERTEX, str(node), *_pose_cells(pose)])
        for node, pose in enumerate(graph.first_from_cam)
    ]
    for edge in graph.edges:
        upper = map(repr, edge.information[_UPPER].tolist())
        pose = _pose_cells(edge.i_from_j)
        lines.append(" ".join([_EDGE, str(edge.i), str(edge.j), *pose, *upper]))
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_g2o(path: Path) -> PoseGraph:
    """Read the vertices and edges of a g2o file; other records are refused.

    Raises:
        InputError: the file cannot be read, holds another record, its vertices are not 0..n-1, or
            edges do not join them all.
    """
    try:
        text = read_text(path)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read as a g2o file ({why(error)})") from error
    vertices: dict[int, Array] = {}
    edges: list[Edge] = []
    for number, line in enumerate(text.splitlines(), start=1):
        kind, *cells = line.split() or [""]
        if kind not in _CELLS:
            raise InputError(path, f"line {number} is not a {_VERTEX} or {_EDGE} record")
        values = _numbers(cells, _CELLS[kind], f"{path}: line {number}")
        n_ids = 1 if kind == _VERTEX else 2
        whole_numbers(values[None, :n_ids], path)
        check_unit(values[None, n_ids + 3 : n_ids + 7], path, np.array([number]))
        if kind == _VERTEX:
            vertices[int(values[0])] = _pose(values[1:])
        else:
            upper = np.zeros((6, 6))
            upper[_UPPER] = values[9:]
            information = upper + np.triu(upper, 1).T
            edges.append(Edge(int(values[0]), int(values[1]), _pose(values[2:9]), information))
    return _graph(vertices, edges, path)


def _graph(vertices: dict[int, Array], edges: Sequence[Edge], path: Path) -> PoseGraph:
    """Build the graph after checking that nodes are numbered 0..n-1 and edges join two of them."""
    if sorted(vertices) != list(range(len(vertices))) or not vertices:
        raise InputError(path, "vertices must be numbered 0 to n-1 without a gap")
    for edge in edges:
        if not (edge.i in vertices and edge.j in vertices and edge.i != edge.j):
            raise InputError(path, f"edge {edge.i} {edge.j} must join two different vertices")
    graph = PoseGraph(np.array([vertices[node] for node in range(len(vertices))]), tuple(edges))
    try:
        check_connected(graph)
    except ValueError as error:
        raise InputError(path, f"{error}; is the file cut short? Make it again") from error
    return graph


def _numbers(cells: Sequence[str], count: int, where: str) -> Array:
    """Read the cells as finite numbers."""
    try:
        values = np.array([float(cell) for cell in cells])
    except ValueError as error:
        raise InputError(where, why(error)) from error
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(where, f"needs {count} finite numbers, found {len(values)}")
    return values


def _pose(values: Array) -> Array:
    """Build a pose (4, 4) from x y z qx qy qz qw."""
    return pose_from_quat(values[:3], values[[6, 3, 4, 5]])


def _pose_cells(pose: Array) -> list[str]:
    """Format the pose as x y z qx qy qz qw."""
    quat_wxyz = quat_wxyz_of(pose)
    return [repr(float(value)) for value in (*pose[:3, 3], *quat_wxyz[[1, 2, 3, 0]])]
