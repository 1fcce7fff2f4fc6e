"""The interface of renderers, what backends share, and what they are given to draw."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh.model import MeshPart, TexturedMesh

Rgb = NDArray[np.uint8]
Depth = NDArray[np.float32]
Faces = NDArray[np.int32]
DEFAULTS = RenderConfig()
SHADERS = Path(__file__).parent / "shaders"
# Mesa's software renderer silently draws nonsense from a buffer of 2^24 vertices on.
MOST_VERTICES = 1 << 23


class UnavailableError(Exception):
    """A library, driver or device that a backend needs is missing, or does not work."""


class Window(NamedTuple):
    """Part of an image, pixels: first column and row, and those one past the last."""

    left: int
    top: int
    right: int
    bottom: int


class Renderer(Protocol):
    """Unlit images of one mesh through one camera.

    What draws a mesh takes ``(mesh, camera, render)``, the camera without distortion.
    """

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        ...

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W), metres along the optical axis or inf."""
        ...

    def render_depth(self, world_from_cam: NDArray[np.float64]) -> Depth:
        """Render depth (H, W) as :meth:`render_rgbd` does, without colours if that is cheaper."""
        return self.render_rgbd(world_from_cam)[1]

    def render_faces(self, world_from_cam: NDArray[np.float64]) -> Faces:
        """Return the index (H, W) of the triangle at the centre of each pixel, -1 for nothing.

        Triangles are counted through all parts of the mesh, as :meth:`TexturedMesh.merged` does.
        """
        ...

    def draw_only(self, window: Window | None) -> None:
        """Ask for no more than a part of the images that follow; None is all of them.

        The part is what it would be without; what lies outside of it means nothing, and costs less
        where a backend can leave it out.
        """
        del window  # nothing is left out unless a backend says how

    def close(self) -> None:
        """Give the mesh's memory back; the renderer must not be used afterwards."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def pieces(part: MeshPart, most_vertices: int = MOST_VERTICES) -> Iterator[MeshPart]:
    """Yield pieces of at most ``most_vertices``, each with the vertices of its own faces."""
    if len(part.vertices_m) <= most_vertices:
        yield part
        return
    step = max(1, most_vertices // 3)
    for start in range(0, len(part.faces), step):
        yield part.over(part.faces[start : start + step])


def drawn_pieces(mesh: TexturedMesh) -> Iterator[tuple[MeshPart, int]]:
    """Yield the drawn parts of a mesh in pieces, each with the index of its first triangle."""
    first = 0
    for part in mesh.parts:
        start = first
        for piece in pieces(part) if part.is_drawn else ():
            yield piece, start
            start += len(piece.faces)
        first += len(part.faces)


def faces_of_halves(halves: NDArray[np.float32]) -> Faces:
    """Decode indices (H, W), -1 for nothing, from pairs of halves (H, W, 2) that shaders wrote.

    Single precision holds whole numbers up to 2^24, and meshes have more triangles.
    """
    high, low = np.moveaxis(halves, -1, 0).astype(np.int32)
    return np.asarray((high << 16) + low - 1, np.int32)


def thresholded(part: MeshPart) -> NDArray[np.uint8]:
    """Threshold the texture's alpha to 0 or 255, or drop it where the part is opaque.

    Texels that are not drawn take the mean colour of those that are: filtering mixes them in at the
    edges and in every mip level, and their own colour is arbitrary.
    """
    assert part.texture is not None
    if part.texture.shape[2] == 3 or part.alpha_cutoff is None:
        return np.ascontiguousarray(part.texture[..., :3])
    alpha = part.texture[..., 3] / 255.0 * (part.base_color[3] / 255.0)
    drawn = alpha >= part.alpha_cutoff
    rgba = np.dstack([part.texture[..., :3], np.where(drawn, 255, 0).astype(np.uint8)])
    rgba[~drawn, :3] = rgba[drawn, :3].mean(axis=0)
    return rgba


# Of a lamp's light, what shows of a surface that is seen edge-on: the lamp is no point.
EDGE_ON_SHARE = 0.3


def floor_share(render: RenderConfig) -> float:
    """Return the least share of its colour that a surface shows, however it is turned.

    ``render.shade: headlight`` is a lamp at the camera that does not fade with distance. A surface
    whose normal and whose line of sight have a cosine c shows ``s + (1 - s) |c|`` of its colour,
    where s is this share; without such a lamp it is 1. Normals are those of the triangles.
    """
    return EDGE_ON_SHARE if render.shade == "headlight" else 1.0


SAMPLES_PER_AXIS = 8  # in each pixel of reference images


def reference_images(
    opened: Callable[[CameraConfig], Renderer],
    camera: CameraConfig,
    poses: Iterable[NDArray[np.float64]],
) -> Iterator[NDArray[np.float32]]:
    """Render the ideal: means over 64 points of each pixel, (H, W, 3) in 0 to 255, unrounded.

    The 64 pinhole images whose principal points differ by eighths of a pixel are, interleaved, one
    image with eight times the pixels along each axis. It is drawn as that one image, so that a
    texture is filtered over the eighth of a pixel a sample stands for, and not over a whole pixel
    64 times.

    Args:
        opened: Opens a renderer for a camera, preferably one without anti-aliasing of its own.
        camera: Camera of the images, at most 1024 pixels wide and high.
        poses: Poses ``world_from_cam`` (4, 4).
    """
    count, width, height = SAMPLES_PER_AXIS, camera.width, camera.height
    finer = {name: count * value for name, value in camera.intrinsics._asdict().items()}
    finer |= {"width": count * width, "height": count * height}
    with opened(camera.model_copy(update=finer)) as renderer:
        for world_from_cam in poses:
            samples = renderer.render(world_from_cam).reshape(height, count, width, count, 3)
            yield np.asarray(samples.mean(axis=(1, 3), dtype=np.float32))
