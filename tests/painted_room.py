"""A room whose walls are full of detail, ray-cast in closed form: every pixel is known exactly.

Nothing of the simulator is used, so what structure from motion makes of these images does not
depend on meshes, scans or renderers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

SIZE_M = np.array([5.0, 6.0, 3.0])
TEXELS_PER_M = 100
SUPERSAMPLING = 2
_GREY = 128.0
_DETAIL = ((1.5, 25.0), (4.0, 30.0), (12.0, 30.0))  # texels, standard deviation of grey values


@dataclass(frozen=True)
class PaintedRoom:
    """A box from the origin to ``SIZE_M``, seen from inside.

    Attributes:
        textures: grey values (H, W) of the walls x = 0, x = max, y = 0, y = max, z = 0, z = max;
            a texture is repeated where the wall is larger.
    """

    textures: tuple[np.ndarray, ...]

    def render(self, world_from_cam, camera):
        """Antialiased colour image (H, W, 3) of a camera without distortion."""
        direction = _directions(world_from_cam, camera)
        origin = world_from_cam[:3, 3]
        with np.errstate(divide="ignore"):
            reach = (np.where(direction > 0, SIZE_M, 0.0) - origin) / direction
        axis = np.argmin(np.where(np.isnan(reach), np.inf, reach), axis=-1)
        distance = np.take_along_axis(reach, axis[..., None], axis=-1)
        texel = (origin + distance * direction) * TEXELS_PER_M
        far = np.take_along_axis(direction, axis[..., None], axis=-1)[..., 0] > 0
        grey = np.zeros(axis.shape)
        for wall, texture in enumerate(self.textures):
            seen = (axis == wall // 2) & (far == wall % 2)
            along = [texel[seen, k] for k in range(3) if k != wall // 2]
            grey[seen] = map_coordinates(texture, along, order=1, mode="grid-wrap")
        return _reduced(grey)


def painted_room(rng, contrast=1.0):
    """A room with another random texture on every wall; without contrast all is grey."""
    return PaintedRoom(tuple(random_texture(rng, contrast) for _ in range(6)))


def random_texture(rng, contrast=1.0):
    """Random grey values (700, 700) with detail at several scales."""
    image = np.zeros((700, 700))
    for sigma, weight in _DETAIL:
        noise = gaussian_filter(rng.standard_normal(image.shape), sigma, mode="wrap")
        image += weight * noise / noise.std()
    return np.asarray(np.clip(_GREY + contrast * image, 0, 255), dtype=np.float64)


def _directions(world_from_cam, camera):
    """Directions (H, W, 3) in the world of the rays through all subpixels, length 1 along z."""
    fx, fy, cx, cy = camera.intrinsics
    step = 1.0 / SUPERSAMPLING
    column = (np.arange(camera.width * SUPERSAMPLING) + 0.5) * step
    row = (np.arange(camera.height * SUPERSAMPLING) + 0.5) * step
    x, y = np.meshgrid((column - cx) / fx, (row - cy) / fy)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    return np.asarray(rays @ world_from_cam[:3, :3].T, dtype=np.float64)


def _reduced(grey):
    """The mean of the subpixels of every pixel, three times."""
    height, width = (side // SUPERSAMPLING for side in grey.shape)
    fine = grey.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING)
    coarse = np.round(fine.mean(axis=(1, 3))).astype(np.uint8)
    return np.repeat(coarse[..., None], 3, axis=2)
