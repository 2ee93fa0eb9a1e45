"""Pictures of a table from above, with NumPy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import breakshot

from ._piles import outer_radius_m, shapes_of

PIXELS_PER_M = 500.0
_SAMPLES = 3
"""Samples of a pixel along each axis, whose mean makes edges smooth."""
_BACKGROUND = (247, 247, 244)
_TABLE = (255, 255, 255)
_STRIKE = (60, 60, 60)
_COLOURS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233), (240, 228, 66))
_MARGIN_M = 0.1

Points = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]


class _Canvas:
    """An area of the table as pixels, y up."""

    def __init__(self, low_m: Points, high_m: Points) -> None:
        self.low_m = low_m - _MARGIN_M
        size_m = high_m - low_m + 2.0 * _MARGIN_M
        self.width, self.height = (int(np.ceil(length_m * PIXELS_PER_M)) for length_m in size_m)
        self.image = np.tile(np.array(_BACKGROUND, dtype=np.float64), (self.height, self.width, 1))

    def fill(self, points_m: Points, colour: tuple[int, int, int]) -> None:
        """Fills a polygon; concave ones too."""
        points = (points_m - self.low_m) * PIXELS_PER_M
        points[:, 1] = self.height - points[:, 1]
        left, top = np.clip(np.floor(points.min(axis=0)).astype(int), 0, (self.width, self.height))
        right, bottom = np.clip(np.ceil(points.max(axis=0)).astype(int), 0, (self.width, self.height))
        if right <= left or bottom <= top:
            return
        offsets = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        x = (np.arange(left, right)[:, None] + offsets).ravel()[None, :]
        y = (np.arange(top, bottom)[:, None] + offsets).ravel()[:, None]
        inside = _inside(points, x, y)
        cover = inside.reshape(bottom - top, _SAMPLES, right - left, _SAMPLES).mean(axis=(1, 3))[..., None]
        area = self.image[top:bottom, left:right]
        area += cover * (np.array(colour) - area)


def _inside(points: Points, x: Points, y: Points) -> npt.NDArray[np.bool_]:
    """Whether points lie in a polygon: an odd number of its sides is to their right."""
    inside = np.zeros((y.shape[0], x.shape[1]), dtype=bool)
    for (x1, y1), (x2, y2) in zip(points, np.roll(points, -1, axis=0), strict=True):
        if y1 != y2:
            crosses = (y1 > y) != (y2 > y)
            inside ^= crosses & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside


def _outline_m(shape: Any) -> Points:
    """The outline of a shape about its centroid."""
    if "disc" in shape:
        angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        return float(shape["disc"]["radius_m"]) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if "rectangle" in shape:
        half_x_m, half_y_m = 0.5 * np.array(shape["rectangle"]["size_m"])
        return np.array([[-half_x_m, -half_y_m], [half_x_m, -half_y_m], [half_x_m, half_y_m], [-half_x_m, half_y_m]])
    return np.array(shape["polygon"]["points_m"], dtype=np.float64)


def _line_m(from_m: Points, to_m: Points, width_m: float) -> Points:
    """The outline of a line."""
    along = to_m - from_m
    across = 0.5 * width_m * np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return np.array([from_m - across, to_m - across, to_m + across, from_m + across])


def picture(scene: breakshot.Scene, strike: Points | None) -> npt.NDArray[np.uint8]:
    """The objects of a scene, a line from the centre of each along its x axis, and a strike: (height, width, 3)."""
    low_m, high_m = (np.array(scene.cell.workspace[end]) for end in ("min_m", "max_m"))
    canvas = _Canvas(low_m, high_m)
    corners = np.array([low_m, [high_m[0], low_m[1]], high_m, [low_m[0], high_m[1]]])
    canvas.fill(corners, _TABLE)
    if strike is not None:
        heading = np.array([np.cos(strike[2]), np.sin(strike[2])])
        canvas.fill(_line_m(strike[:2], strike[:2] + strike[4] * heading, 0.004), _STRIKE)
        canvas.fill(_outline_m(scene.cell.striker["shape"]) + strike[:2], _STRIKE)
    shapes = shapes_of(scene, [placed.object for placed in scene.placed])
    for k, (placed, shape) in enumerate(zip(scene.placed, shapes, strict=True)):
        cos, sin = np.cos(placed.yaw_rad), np.sin(placed.yaw_rad)
        rotation = np.array([[cos, -sin], [sin, cos]])
        centre_m = np.array(placed.position_m)
        canvas.fill(_outline_m(shape) @ rotation.T + centre_m, _COLOURS[k % len(_COLOURS)])
        tip_m = centre_m + rotation @ np.array([0.8 * outer_radius_m(shape), 0.0])
        canvas.fill(_line_m(centre_m, tip_m, 0.003), _TABLE)
    return np.round(canvas.image).astype(np.uint8)
