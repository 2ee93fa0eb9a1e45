"""Films of the table: a tilted pinhole camera, prisms with dark markers, blur, noise, written as Y4M.  NumPy alone."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from .table import outline

SIZE_PX = (640, 400)
FOCAL_PX = 880.0
RATE_HZ = 60
SHUTTER_S = 0.004
SUBFRAMES = 3
SIDES = 4
"""Heights at which the side of a prism is drawn."""
NOISE = 2.0
"""Standard deviation of a pixel (of 255)."""
POINT_NOISE_PX = 0.1
GREY = {"table": 150.0, "top": 215.0, "side": 185.0, "marker": 40.0, "striker": 95.0}


def camera(rng: np.random.Generator) -> np.ndarray:
    """The projection matrix (3, 4) of a camera above the table that is tilted by 5 to 15 degrees."""
    tilt_rad, turn_rad = math.radians(rng.uniform(5.0, 15.0)), math.radians(rng.uniform(-4.0, 4.0))
    distance_m = rng.uniform(1.28, 1.36)
    # The image is the table seen from above with y up: x to the right, y of pixels down.
    flip = np.diag([1.0, -1.0, -1.0])
    cos, sin = math.cos(tilt_rad), math.sin(tilt_rad)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
    turn = np.array([[math.cos(turn_rad), -math.sin(turn_rad), 0.0], [math.sin(turn_rad), math.cos(turn_rad), 0.0], [0.0, 0.0, 1.0]])
    pose = np.hstack([tilt @ flip @ turn, [[0.0], [0.0], [distance_m]]])
    centre = ((SIZE_PX[0] - 1) / 2, (SIZE_PX[1] - 1) / 2)
    return np.array([[FOCAL_PX, 0.0, centre[0]], [0.0, FOCAL_PX, centre[1]], [0.0, 0.0, 1.0]]) @ pose


def project(matrix: np.ndarray, points: np.ndarray, height_m: float) -> np.ndarray:
    """Pixels of points at a height above the table."""
    world = np.column_stack([points, np.full(len(points), height_m), np.ones(len(points))])
    image = world @ matrix.T
    return image[:, :2] / image[:, 2:]


def reference_points(matrix: np.ndarray, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Eight known points of the table and where they are seen."""
    table = np.array([[x, y] for x in (-0.4, -0.15, 0.15, 0.4) for y in (-0.22, 0.22)])
    seen = project(matrix, table, 0.0) + rng.normal(0.0, POINT_NOISE_PX, table.shape)
    return [{"image_px": image.tolist(), "table_m": point.tolist()} for image, point in zip(seen, table, strict=True)]


def _inward_m(shape: dict[str, Any], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distance of points to the outline of a convex shape, positive inside."""
    if "disc" in shape:
        return shape["disc"]["radius_m"] - np.hypot(x, y)
    points = outline(shape)
    inward = np.full(x.shape, np.inf)
    for (x0, y0), (x1, y1) in zip(points, np.roll(points, -1, axis=0), strict=True):
        length = math.hypot(x1 - x0, y1 - y0)
        inward = np.minimum(inward, ((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / length)
    return inward


class _Painter:
    """Draws flat convex shapes at heights above the table, with smooth edges."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.matrix = matrix
        self.px_per_m = FOCAL_PX / float(matrix[2, 3])

    def fill(self, image: np.ndarray, shape: dict[str, Any], pose: Any, height_m: float, grey: float) -> None:
        reach_px = np.hypot(*np.abs(outline(shape)).max(axis=0)) * self.px_per_m * 1.2 + 3.0
        [centre] = project(self.matrix, np.array([pose[:2]]), height_m)
        left, top = np.clip(np.floor(centre - reach_px).astype(int), 0, SIZE_PX)
        right, bottom = np.clip(np.ceil(centre + reach_px).astype(int), 0, SIZE_PX)
        if right <= left or bottom <= top:
            return
        plane = np.column_stack([self.matrix[:, 0], self.matrix[:, 1], self.matrix[:, 2] * height_m + self.matrix[:, 3]])
        u, v = np.meshgrid(np.arange(left, right), np.arange(top, bottom))
        x, y, w = np.einsum("ij,jkl->ikl", np.linalg.inv(plane), np.stack([u, v, np.ones_like(u)]))
        x, y = x / w - pose[0], y / w - pose[1]
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        cover = np.clip(0.5 + _inward_m(shape, cos * x + sin * y, cos * y - sin * x) * self.px_per_m, 0.0, 1.0)
        area = image[top:bottom, left:right]
        area += cover * (grey - area)

    def prism(self, image: np.ndarray, known: dict[str, Any], pose: Any, top: float, side: float) -> None:
        for height_m in np.linspace(0.0, known["height_m"], SIDES, endpoint=False):
            self.fill(image, known["shape"], pose, float(height_m), side)
        self.fill(image, known["shape"], pose, known["height_m"], top)
        if "marker_radius_m" in known:
            self.fill(image, {"disc": {"radius_m": known["marker_radius_m"]}}, pose, known["height_m"], GREY["marker"])


def frames(drawn: dict[str, Any], names: list[str], matrix: np.ndarray, motion: Any, rng: np.random.Generator) -> list[np.ndarray]:
    """The pictures of a motion (times, poses, striker), 8 bits."""
    times, poses, striker = motion
    painter = _Painter(matrix)
    light = np.linspace(-12.0, 12.0, SIZE_PX[0])[None, :] + rng.normal(0.0, 1.5, SIZE_PX[::-1])
    rod = {"shape": {"disc": {"radius_m": drawn["striker"]["radius_m"]}}, "height_m": drawn["striker"]["height_m"]}
    pictures = []
    for time_s in np.arange(0.0, times[-1] - SHUTTER_S, 1.0 / RATE_HZ):
        light_sum = np.zeros(SIZE_PX[::-1])
        for part in range(SUBFRAMES):
            at = np.searchsorted(times, time_s + SHUTTER_S * ((part + 0.5) / SUBFRAMES - 0.5))
            at = min(int(at), len(times) - 1)
            image = GREY["table"] + light
            bodies = [(poses[at, k], drawn["objects"][name], GREY["top"], GREY["side"]) for k, name in enumerate(names)]
            bodies.append((np.array([*striker[at], 0.0]), rod, GREY["striker"], GREY["striker"]))
            # The camera looks from negative y: what is farther away is drawn first.
            for pose, known, top, side in sorted(bodies, key=lambda body: -body[0][1]):
                painter.prism(image, known, pose, top, side)
            light_sum += image
        noisy = light_sum / SUBFRAMES + rng.normal(0.0, NOISE, light_sum.shape)
        pictures.append(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    return pictures


def write_y4m(path: Path, pictures: list[np.ndarray]) -> None:
    """A film of grey pictures."""
    with open(path, "wb") as file:
        file.write(f"YUV4MPEG2 W{SIZE_PX[0]} H{SIZE_PX[1]} F{RATE_HZ}:1 Ip A1:1 Cmono\n".encode())
        for picture in pictures:
            file.write(b"FRAME\n")
            file.write(picture.tobytes())


def read_y4m(path: str | Path) -> np.ndarray:
    """The pictures of such a film: (frames, height, width)."""
    data = Path(path).read_bytes()
    head, _, body = data.partition(b"\n")
    words = {word[:1]: word[1:] for word in head.decode().split()[1:]}
    width, height = int(words["W"]), int(words["H"])
    size = width * height + len(b"FRAME\n")
    return np.frombuffer(body, np.uint8).reshape(-1, size)[:, -width * height :].reshape(-1, height, width)
