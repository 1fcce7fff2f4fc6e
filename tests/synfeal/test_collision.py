"""The collision mesh: what is kept, how it is chosen, and the curve that shows it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from synfeal.collection.collision import (
    Rung,
    collision_mesh,
    ladder,
    last_agreeing,
    search,
)
from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import (
    Triangles,
    load_collision_mesh,
    merge_vertices,
    save_collision_mesh,
    simplify,
)
from synfeal.planning.space import draw_questions
from tests.support.empty_room import ROOM, SCENE

N_QUESTIONS = 4000
BOX = np.array([[-2.8, -1.8, 0.8], [2.8, 1.8, 1.8]])
RUNG = Rung(100, 1.0, 0.99, 1.0, 0, 0, 1, 1, 0.0)


def triangles_of(*meshes):
    joined = trimesh.util.concatenate(list(meshes))
    return merge_vertices(np.asarray(joined.vertices), np.asarray(joined.faces))


def divided(mesh, times):
    for _ in range(times):
        mesh = mesh.subdivide()
    return mesh


def open_column():
    """Four sheets from floor to ceiling, without lids: 8 triangles a quadric holds for flat."""
    box = trimesh.creation.box(bounds=[[-0.2, -0.2, 0.0], [0.2, 0.2, 2.5]])
    return trimesh.Trimesh(box.vertices, box.faces[np.abs(box.face_normals[:, 2]) < 0.5])


@pytest.fixture(scope="module")
def furnished():
    """A room with a column, a plate and a cupboard, finely divided: 4,040 triangles."""
    room = divided(trimesh.creation.box(bounds=ROOM), 4)
    plate = divided(trimesh.creation.box(bounds=[[1.0, -1.0, 1.0], [2.0, 1.0, 1.01]]), 2)
    cupboard = divided(trimesh.creation.box(bounds=[[-3.0, 1.0, 0.0], [-2.0, 2.0, 2.0]]), 3)
    return triangles_of(room, open_column(), plate, cupboard)


@pytest.fixture(scope="module")
def questions(furnished):
    rng = np.random.default_rng(1)
    return draw_questions(RayCaster(*furnished), SCENE, BOX, rng, N_QUESTIONS)


@pytest.fixture(scope="module")
def trials(furnished, questions):
    return search(furnished, questions, 0.995)


def test_a_divided_room_needs_few_of_its_triangles(furnished, trials):
    (chosen,) = (trial for trial in trials if trial.rung.chosen)
    assert chosen.rung.faces == len(chosen.mesh.faces) < len(furnished.faces) / 8
    full, few = RayCaster(*furnished), RayCaster(*chosen.mesh)
    fresh = draw_questions(full, SCENE, BOX, np.random.default_rng(2))
    # Questions it was not chosen on: 0.995 less three standard deviations of 4,000 and of 10,000.
    assert np.mean(fresh.answers(full) == fresh.answers(few)) >= 0.991


def test_every_line_of_the_curve_can_be_counted_again(furnished, questions, trials):
    expected = questions.answers(RayCaster(*furnished))
    faces = [trial.rung.faces for trial in trials]
    assert faces == sorted(faces, reverse=True)
    for trial in trials:
        found, rung = questions.answers(RayCaster(*trial.mesh)), trial.rung
        assert rung.agreement == np.mean(found == expected)
        assert rung.wrongly_admitted == np.sum(found & ~expected)
        assert rung.wrongly_refused == np.sum(~found & expected)
        assert rung.agreement_low <= rung.agreement <= rung.agreement_high
    assert trials[0].rung.agreement == 1.0
    # Wilson at p = 1: n / (n + z²)
    low = N_QUESTIONS / (N_QUESTIONS + 1.959964**2)
    assert trials[0].rung.agreement_low == pytest.approx(low, abs=1e-6)


def test_an_open_column_keeps_its_height():
    column = triangles_of(divided(open_column(), 3))
    for n_faces in (256, 64, 16):
        caster = RayCaster(*simplify(column, n_faces))
        starts = np.c_[np.full(50, -1.0), np.zeros(50), np.linspace(0.01, 2.49, 50)]
        assert not caster.sees(starts, starts + np.array([2.0, 0.0, 0.0])).any()


def test_simplification_is_the_same_at_map_coordinates(furnished):
    offset = np.array([5e5, 4e6, 100.0])
    here = simplify(furnished, 1000)
    there = simplify(Triangles(furnished.vertices_m + offset, furnished.faces), 1000)
    starts, far = (
        np.tile([-1.0, 0.5, 1.5], (2000, 1)),
        np.random.default_rng(0).uniform(*BOX, (2000, 3)),
    )
    moved = RayCaster(*there).sees(starts + offset, far + offset)
    assert np.mean(RayCaster(*here).sees(starts, far) == moved) > 0.995


@settings(derandomize=True, deadline=None)
@given(st.lists(st.floats(0, 1), max_size=12), st.floats(0.5, 1))
def test_the_choice_is_the_last_of_an_unbroken_run(rest, least):
    rungs = [replace(RUNG, agreement=value) for value in (1.0, *rest)]
    last = last_agreeing(rungs, least)
    assert all(rung.agreement >= least for rung in rungs[: last + 1])
    assert last + 1 == len(rungs) or rungs[last + 1].agreement < least


@pytest.mark.parametrize(
    ("n_faces", "expected"), [(12, []), (100, []), (101, [100]), (1000, [800, 400, 200, 100])]
)
def test_ladder(n_faces, expected):
    assert ladder(n_faces) == expected


def test_the_choice_does_not_depend_on_the_clock_and_full_agreement_can_be_asked(
    furnished, questions, trials
):
    for a, b in zip(trials, search(furnished, questions, 0.995), strict=True):
        np.testing.assert_array_equal(a.mesh.vertices_m, b.mesh.vertices_m)
        assert a.rung.chosen == b.rung.chosen
    (chosen,) = (trial.rung for trial in search(furnished, questions, 1.0) if trial.rung.chosen)
    assert chosen.agreement == 1.0


def test_no_face_count_is_measured_twice():
    """Eight boxes in a room have 108 triangles; the ladder ends at 100, where a box is dented."""
    boxes = [
        trimesh.creation.box((0.8, 0.8, 1.2)).apply_translation([x, y, 1.2])
        for x in (-2.2, -0.8, 0.8, 2.2)
        for y in (-1.2, 1.2)
    ]
    full = triangles_of(trimesh.creation.box(bounds=ROOM), *boxes)
    asked = draw_questions(RayCaster(*full), SCENE, BOX, np.random.default_rng(1), 1000)
    found = [trial.rung.faces for trial in search(full, asked, 1.0)]
    assert found[0] == 108
    assert found[-1] == 100
    assert found == sorted(set(found), reverse=True)


def test_small_meshes_are_not_decimated_and_one_without_a_free_view_is_refused():
    box = trimesh.creation.box(bounds=ROOM)
    mesh = TexturedMesh((MeshPart("room", np.asarray(box.vertices), np.asarray(box.faces)),))
    collision, curve = collision_mesh(mesh, SCENE, BOX, 0.995, np.random.default_rng(0))
    assert len(collision.faces) == 12
    assert [(rung.faces, rung.chosen) for rung in curve] == [(12, 1)]
    scene = SCENE.model_copy(update={"min_view_distance_m": 20.0})
    with pytest.raises(InputError, match="min_view_distance_m"):
        collision_mesh(mesh, scene, BOX, 0.995, np.random.default_rng(0))


def test_seam_copies_are_merged_and_files_keep_map_coordinates(tmp_path):
    box = trimesh.creation.box()
    soup, faces = box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    vertices, merged = merge_vertices(soup, faces)
    assert len(vertices) == 8
    np.testing.assert_allclose(vertices[merged], soup[faces], atol=1e-5)
    offset = np.array([5e5, 4e6, 100.123456789])
    mesh = Triangles(np.asarray(box.vertices) + offset, np.asarray(box.faces))
    save_collision_mesh(tmp_path / "collision.ply", mesh)
    back = load_collision_mesh(tmp_path / "collision.ply")
    np.testing.assert_array_equal(back.vertices_m, mesh.vertices_m)
    np.testing.assert_array_equal(back.faces, mesh.faces)
    with pytest.raises(InputError, match="collision mesh"):
        load_collision_mesh(tmp_path / "none.ply")
    # A reader of another house finds the same in it.
    found = trimesh.load_mesh(tmp_path / "collision.ply", process=False)
    np.testing.assert_array_equal(found.vertices, mesh.vertices_m)
    np.testing.assert_array_equal(found.faces, mesh.faces)


@pytest.mark.parametrize("broken", [MemoryError, AttributeError])
def test_faults_of_the_program_are_no_damaged_collision_mesh(broken, tmp_path, monkeypatch):
    def fail(_):
        raise broken("of ours")

    monkeypatch.setattr("pathlib.Path.read_bytes", fail)
    with pytest.raises(broken, match="of ours"):
        load_collision_mesh(tmp_path / "collision.ply")
