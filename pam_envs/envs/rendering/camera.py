"""Camera of three-dimensional scenes: projection of points to the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.envs.rendering.scene import Point


@dataclass(frozen=True)
class Camera:
    """Parallel projection of a world whose z points down.

    ``azimuth`` around the vertical and ``elevation`` above the horizontal are the direction of the
    camera [rad], ``scale`` pixels per metre, ``middle`` the position of the origin [pixels].
    """

    azimuth: float
    elevation: float
    scale: float = 1.0
    middle: Point = (0.0, 0.0)

    def flat(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points (..., 3) [m] as (..., 2) pixels: right and down."""
        x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
        sine, cosine = math.sin(self.azimuth), math.cos(self.azimuth)
        right, near = cosine * x + sine * y, cosine * y - sine * x
        down = math.cos(self.elevation) * z + math.sin(self.elevation) * near
        flat = np.stack([right, down], -1)
        return np.asarray(self.scale * flat + np.array(self.middle))

    def line(self, points: ArrayLike) -> list[Point]:
        """Return points (n, 3) [m] as a list of positions [pixels]."""
        return [(float(x), float(y)) for x, y in self.flat(points)]

    def fitted(self, points: ArrayLike, box: tuple[float, float, float, float]) -> Camera:
        """Return the camera with the largest scale at which points (n, 3) [m] fit a box."""
        plain = Camera(self.azimuth, self.elevation).flat(points)
        low, high = plain.min(axis=0), plain.max(axis=0)
        scale = float(min(np.array(box[2:]) / np.maximum(high - low, 1e-9)))
        centre = np.array(box[:2]) + 0.5 * np.array(box[2:])
        across, down = (centre - 0.5 * scale * (low + high)).tolist()
        return Camera(self.azimuth, self.elevation, scale, (across, down))
