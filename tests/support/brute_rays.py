"""Rays against triangles by the textbook, in double precision: slow, and independent of Embree."""

import numpy as np

from synfeal.mesh.model import TexturedMesh

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])


def first_hits(corners_m, origin_m, directions):
    """Parameter and index (N,) of the first triangle on rays of one origin; inf and -1 for none.

    Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", JGT 2(1), 1997.

    Args:
        corners_m: Triangles (F, 3, 3).
        origin_m: Where rays start (3,).
        directions: Directions (N, 3).
    """
    first, second = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    offset = origin_m - corners_m[:, 0]
    across = np.cross(offset, first)
    along = np.einsum("fi,fi->f", second, across)
    distance, face = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for start in range(0, len(directions), 256):
        rays = directions[start : start + 256]
        turned = np.cross(rays[:, None], second[None])
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / np.einsum("nfi,fi->nf", turned, first)
            u = np.einsum("nfi,fi->nf", turned, offset) * inverse
            v = rays @ across.T * inverse
            met = along * inverse
            hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (met > 1e-6)
        met = np.where(hit, met, np.inf)
        nearest = met.argmin(axis=1)
        distance[start : start + 256] = met[np.arange(len(rays)), nearest]
        face[start : start + 256] = np.where(hit.any(axis=1), nearest, -1)
    return distance, face


class Truth:
    """Points that the pixels of a perspective camera show, and which pixels are beyond doubt.

    Attributes:
        face: Triangle (H, W) on the ray through the pixel's centre, -1 for none.
        depth_m: Depth (H, W) along the optical axis.
        normal_cam: Unit normal (H, W, 3) of it, facing the camera.
        clear: Pixels (H, W) at whose centre no edge is nearer than ``margin_px``: four rays
            around it, that far along both axes, meet the same triangle.
    """

    def __init__(self, mesh: TexturedMesh, camera, world_from_cam, rays_of, margin_px=0.02):
        """Cast five rays for each pixel; ``rays_of`` gives rays, z = 1, of pixels (..., 2)."""
        vertices, faces = mesh.merged()
        corners_m = vertices[faces]
        pixel = np.stack(
            np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5), axis=-1
        )
        casts = []
        for step in (np.zeros((1, 2)), margin_px * CORNERS):
            rays = rays_of(pixel + step[:, None, None])
            turned = rays.reshape(-1, 3) @ world_from_cam[:3, :3].T
            found = first_hits(corners_m, world_from_cam[:3, 3], turned)
            casts.append([each.reshape(rays.shape[:-1]) for each in found])
        (depth, face), (_, around) = casts
        self.depth_m, self.face = depth[0], face[0]
        self.clear = (around == face).all(axis=0)
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.concatenate([normal, np.zeros((1, 3))])[self.face] @ world_from_cam[:3, :3]
        away = np.einsum("hwi,hwi->hw", normal, rays_of(pixel)) > 0.0
        self.normal_cam = np.where(away[..., None], -normal, normal)


def pinhole_rays(camera):
    """Rays of the pixels of a camera without distortion, by its definition."""
    fx, fy, cx, cy = camera.intrinsics

    def rays_of(pixel):
        x, y = (pixel[..., 0] - cx) / fx, (pixel[..., 1] - cy) / fy
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    return rays_of
