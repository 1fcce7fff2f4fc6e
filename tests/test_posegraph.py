import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from baselines.groundtruth.posegraph.graph import (
    Edge,
    PoseGraph,
    edge_residuals,
    read_g2o,
    swapped_blocks,
    write_g2o,
)
from baselines.groundtruth.posegraph.lm import optimise_lm
from baselines.groundtruth.posegraph.toro import optimise_toro
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_matrix, relative

INFORMATION = np.diag([1e4] * 3 + [1e5] * 3)
SIGMA_M, SIGMA_RAD = 1e-2, 1e5**-0.5
OPTIMISERS = {
    "lm": lambda graph: optimise_lm(graph, 50),
    "toro": lambda graph: optimise_toro(graph, 150, 1e-9),
}


def small_motion(rng, sigma_m, sigma_rad):
    return pose_matrix(
        Rotation.from_rotvec(sigma_rad * rng.normal(size=3)).as_matrix(),
        sigma_m * rng.normal(size=3),
    )


def circle(count):
    """Poses on a circle of radius 1 m that rises, turning with it; the first is the identity."""
    angle = 2 * np.pi * np.arange(count) / count
    rotation = Rotation.from_euler("z", angle[:, None]).as_matrix()
    position = np.column_stack([np.sin(angle), 1 - np.cos(angle), 0.1 * angle])
    return pose_matrix(rotation, position)


def loop_graph(count, noise, rng, loops=((0, -1), (0, 5), (3, 9), (7, 2))):
    """A loop of neighbours and some closures, measured with ``noise`` times the sigmas.

    The initial poses chain the neighbours, as odometry does.
    """
    truth = circle(count)
    pairs = [(k, k + 1) for k in range(count - 1)]
    pairs += [(i % count, j % count) for i, j in loops]
    edges = []
    for i, j in pairs:
        error = small_motion(rng, noise * SIGMA_M, noise * SIGMA_RAD)
        edges.append(Edge(i, j, relative(truth[i], truth[j]) @ error, INFORMATION))
    initial = [np.eye(4)]
    for edge in edges[: count - 1]:
        initial.append(initial[-1] @ edge.i_from_j)
    return truth, PoseGraph(np.array(initial), tuple(edges))


def scipy_solution(graph):
    """Minimum of the same sum of squares by another library, poses as exponentials of twists."""
    start = RigidTransform.from_matrix(graph.first_from_cam[1:])
    root = np.sqrt(np.diag(swapped_blocks(INFORMATION)))  # twists are rotation first

    def residuals(twists):
        moved = start * RigidTransform.from_exp_coords(twists.reshape(-1, 6))
        poses = [RigidTransform.identity(), *moved]
        return np.concatenate(
            [
                root
                * (
                    RigidTransform.from_matrix(edge.i_from_j).inv()
                    * poses[edge.i].inv()
                    * poses[edge.j]
                ).as_exp_coords()
                for edge in graph.edges
            ]
        )

    found = least_squares(residuals, np.zeros(6 * len(start)), xtol=1e-12, ftol=1e-12)
    moved = start * RigidTransform.from_exp_coords(found.x.reshape(-1, 6))
    return np.concatenate([np.eye(4)[None], moved.as_matrix()])


def test_lm_finds_the_minimum_that_scipy_finds():
    _, graph = loop_graph(12, 1.0, np.random.default_rng(2))
    expected = scipy_solution(graph)
    assert pose_error(expected, graph.first_from_cam)[0].max() > 1e-3
    np.testing.assert_allclose(optimise_lm(graph, 50), expected, atol=1e-6)


@pytest.mark.parametrize("name", OPTIMISERS)
def test_confident_edges_move_less(name):
    """Two edges disagree on one motion: the answer is their mean, weighted by information."""
    near, far = pose_matrix(np.eye(3), [1.0, 0, 0]), pose_matrix(np.eye(3), [2.0, 0, 0])
    edges = (Edge(0, 1, near, 3 * INFORMATION), Edge(0, 1, far, INFORMATION))
    graph = PoseGraph(np.array([np.eye(4), far]), edges)
    found = OPTIMISERS[name](graph)
    np.testing.assert_allclose(found[1, :3, 3], [1.25, 0, 0], atol=0.02)


def test_toro_shares_a_loop_residual_evenly_along_equal_edges():
    """A square of translations whose closure is off by 0.4 m: each of its edges takes 0.1 m."""
    steps = [[1, 0, 0], [0, 1, 0], [-1, 0, 0]]
    positions = np.array([[0, 0, 0], *np.cumsum(steps, axis=0)], dtype=float)
    poses = pose_matrix(np.tile(np.eye(3), (4, 1, 1)), positions)
    edges = [Edge(k, k + 1, relative(poses[k], poses[k + 1]), INFORMATION) for k in range(3)]
    edges.append(Edge(3, 0, pose_matrix(np.eye(3), [0, -1.4, 0]), INFORMATION))
    graph = PoseGraph(poses, tuple(edges))
    # Rotations are pinned by their weight, so the problem is linear with this closed form.
    stiff = tuple(Edge(e.i, e.j, e.i_from_j, np.diag([1e4] * 3 + [1e12] * 3)) for e in graph.edges)
    found = optimise_toro(PoseGraph(poses, stiff), 150, 1e-12)
    residuals = edge_residuals(graph, found)[:, :3]
    np.testing.assert_allclose(np.abs(residuals[:, 1]), 0.1, atol=0.01)
    np.testing.assert_allclose(residuals[:, [0, 2]], 0, atol=1e-6)


def full_information(rng):
    root = rng.normal(size=(6, 6))
    return root @ root.T + np.eye(6)


def test_g2o_file_reads_the_same_in_gtsam(tmp_path):
    """gtsam reads the file we write: same poses, and information with rotation first."""
    import gtsam

    rng = np.random.default_rng(4)
    _, graph = loop_graph(6, 1.0, rng, loops=((0, -1),))
    edges = tuple(Edge(e.i, e.j, e.i_from_j, full_information(rng)) for e in graph.edges)
    path = tmp_path / "graph.g2o"
    write_g2o(path, PoseGraph(graph.first_from_cam, edges))
    factors, values = gtsam.readG2o(str(path), True)
    for node, pose in enumerate(graph.first_from_cam):
        np.testing.assert_allclose(values.atPose3(node).matrix(), pose, atol=1e-12)
    for k, edge in enumerate(edges):
        factor = factors.at(k)
        assert list(factor.keys()) == [edge.i, edge.j]
        np.testing.assert_allclose(factor.measured().matrix(), edge.i_from_j, atol=1e-12)
        found = factor.noiseModel().information()
        np.testing.assert_allclose(found, swapped_blocks(edge.information), rtol=1e-9, atol=1e-9)


VERTEX = "VERTEX_SE3:QUAT"


def edge_line(i, j, w=1):
    return f"EDGE_SE3:QUAT {i} {j} 0 0 0 0 0 0 {w}" + 21 * " 1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "numbered 0 to n-1"),
        ("FIX 0\n", "line 1 is no"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0\n", "line 1: needs 8 finite numbers, found 7"),
        ("VERTEX_SE3:QUAT 0 0 0 zero 0 0 0 1\n", "line 1: 'zero' is no number"),
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n", "numbered 0 to n-1"),
        (
            "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1" + 21 * " 1" + "\n",
            "edge 0 1 must join",
        ),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{VERTEX} 1 0 0 0 0 0 0 1\n{edge_line(1, 1)}", "edge 1 1 must"),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{edge_line(1, 0)}", "edge 1 0 must join two different"),
        (
            f"{VERTEX} 0 0 0 0 0 0 0 1\n{VERTEX} 1 0 0 0 0 0 0 1\n",
            "node 1 is not connected to node 0 by edges; is the file cut short",
        ),
        (
            f"{VERTEX} 0 0 0 0 0 0 0 1\n\n",
            "line 2 is not a VERTEX_SE3:QUAT or EDGE_SE3:QUAT record",
        ),
        (f"{VERTEX} 0 0 0 inf 0 0 0 1\n", "line 1: needs 8 finite numbers, found 8"),
        (f"{VERTEX} 0 0 0 0 0 0 0 2\n", "line 1 holds a quaternion of length 2"),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{edge_line(0, 1)[:-2]}", "line 2: needs 30 .* found 29"),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{edge_line(0, 0.5)}", "must begin with whole numbers"),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{edge_line(0, 1, w=3)}", "line 2 holds a quaternion of"),
        (f"{VERTEX} 0.5 0 0 0 0 0 0 1\n", "must begin with whole numbers"),
        (f"{VERTEX} 0 0 0 0 0 0 0 1\n{VERTEX} 2 0 0 0 0 0 0 1\n", "numbered 0 to n-1 without"),
        ("\udcff", "cannot be read as a g2o file"),
    ],
)
def test_broken_g2o_files_are_named(tmp_path, text, message):
    path = tmp_path / "graph.g2o"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(InputError, match=message) as caught:
        read_g2o(path)
    assert str(caught.value).startswith(str(path))
