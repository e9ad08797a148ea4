"""View of a redundant manipulator: the arm with its muscles, its path, its shadow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.envs.joint.view import JointIntegral, angle_ticks
from pam_envs.envs.rendering import scene as S


@dataclass(frozen=True)
class Camera:
    """Parallel projection of a world whose z points down.

    ``azimuth`` around the vertical and ``elevation`` above the horizontal are the direction of the
    camera [rad], ``scale`` pixels per metre, ``middle`` the position of the origin [pixels].
    """

    azimuth: float
    elevation: float
    scale: float = 1.0
    middle: S.Point = (0.0, 0.0)

    def flat(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points (..., 3) [m] as (..., 2) pixels: right and down."""
        x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
        sine, cosine = math.sin(self.azimuth), math.cos(self.azimuth)
        right, near = cosine * x + sine * y, cosine * y - sine * x
        down = math.cos(self.elevation) * z + math.sin(self.elevation) * near
        flat = np.stack([right, down], -1)
        return np.asarray(self.scale * flat + np.array(self.middle))

    def line(self, points: ArrayLike) -> list[S.Point]:
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


BOX = (12.0, 40.0, 246.0, 440.0)
"""Area of the arm in the picture: left, top, width, height [pixels]."""
SCENE = (0, 0, 330, 600)
PLATE = ((-0.15, -0.15), (0.15, -0.15), (0.15, 0.15), (-0.15, 0.15))
CAMERA = Camera(math.radians(-32.0), math.radians(17.0))
BELOW = 0.12
"""Distance [m] of the floor below the straight arm."""
POINTER = 0.09
"""Length [m] of the tool's pointer."""
SHADE = (214, 216, 218)


def path_of(env: Any, info: Any) -> NDArray[np.float64]:
    """Return the episode's path: poses and planned angles, shape (6 + n, points)."""
    rows = 6 + env.plant.stages
    first = rows * round(info["state/path"])
    return np.asarray(env.setup.shared[1][first : first + rows])


def _camera(plant: Any, path: NDArray[np.float64]) -> tuple[Camera, float]:
    """Return a camera that sees the whole path and all arms along it, and the floor's depth [m]."""
    floor = float(plant.chain.reach) + BELOW
    arms = plant.chain.joints(path[6:, ::10].T).reshape(-1, 3)
    base = np.array([[x, y, 0.0] for x in (-0.2, 0.2) for y in (-0.2, 0.2)])
    shadows = np.column_stack([arms[:, :2], np.full(len(arms), floor)])
    (left, near), (right, far) = _floor(path)
    corners = [(x, y, floor) for x in (left, right) for y in (near, far)]
    return CAMERA.fitted(np.vstack([arms, base, shadows, corners]), BOX), floor


def _floor(path: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest x and y [m] of the squares below a path and the base."""
    points = np.vstack([path[:2].T, np.zeros((1, 2))])
    low = np.floor(points.min(axis=0) / 0.2 - 0.5) * 0.2
    high = np.ceil(points.max(axis=0) / 0.2 + 0.5) * 0.2
    return low, high


def _grid(canvas: S.Canvas, camera: Camera, path: NDArray[np.float64], depth: float) -> None:
    """Draw squares of 0.2 m on the floor, as far as the path reaches."""
    low, high = _floor(path)
    for x in np.arange(low[0], high[0] + 0.01, 0.2):
        canvas.line(camera.line([(x, low[1], depth), (x, high[1], depth)]), S.GRID, 1)
    for y in np.arange(low[1], high[1] + 0.01, 0.2):
        canvas.line(camera.line([(low[0], y, depth), (high[0], y, depth)]), S.GRID, 1)


def _arm(canvas: S.Canvas, camera: Camera, plant: Any, info: Any) -> None:
    """Draw links and muscles, from the back to the front."""
    angles = [info[f"state/angle_{k}"] for k in range(plant.stages)]
    axes, points, directions = plant.chain.frames(angles)
    full = plant.regulator.max_pressure
    for k in range(plant.stages):
        start, end = points[k], points[k + 1]
        before = directions[k - 1] if k else np.array([0.0, 0.0, 1.0])
        sides = []
        for way, muscle in ((1.0, "a"), (-1.0, "b")):
            out = way * plant.lever.r_o * np.cross(axes[k], directions[k])
            root = way * plant.lever.r_u * np.cross(axes[k], before)
            span = 0.4 * plant.chain.lengths[k]
            tint = S.blend(S.COLD, S.HOT, info[f"state/pressure_{k}{muscle}"] / full)
            ends = camera.line([start + root - span * before, start + out + span * directions[k]])
            depth = float(out @ np.array([-math.sin(CAMERA.azimuth), math.cos(CAMERA.azimuth), 0]))
            sides.append((depth, ends, tint))
        sides.sort(key=lambda side: side[0])
        far, near = sides
        S.limb(canvas, far[1][0], far[1][1], 4.5, 4.5, S.blend(far[2], S.PAPER, 0.25))
        bone = camera.line([start, end])
        S.limb(canvas, bone[0], bone[1], 3.5, 3.5, S.blend(S.STEEL, S.INK, 0.25))
        S.limb(canvas, near[1][0], near[1][1], 4.5, 4.5, near[2])
        canvas.disc(bone[0], 6.0, S.INK)
        canvas.disc(bone[0], 3.0, S.PAPER)


def _tool(canvas: S.Canvas, camera: Camera, info: Any) -> None:
    """Draw position and direction of the tool, and their references."""
    for key, color, wide in (("reference_", S.REFERENCE, 2.0), ("", S.OUTPUT, 3.0)):
        tip = np.array([info[f"state/{key}{name}"] for name in ("x", "y", "z")])
        to = np.array([info[f"state/{key}point_{name}"] for name in ("x", "y", "z")])
        ends = camera.line([tip, tip + POINTER * to])
        canvas.line(ends, color, wide)
        canvas.disc(ends[0], 5.0, color)


def arm_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw the arm in its world, with its path and its shadow."""
    plant, path = env.plant, path_of(env, info)
    camera, floor = _camera(plant, path)
    points = plant.chain.joints([info[f"state/angle_{k}"] for k in range(plant.stages)])
    planned = plant.chain.joints([info[f"state/joint_reference_{k}"] for k in range(plant.stages)])
    with canvas.within(SCENE):
        _grid(canvas, camera, path, floor)
        for line, width in ((path[:2].T, 2), (points[:, :2], 6)):
            shadow = np.column_stack([line, np.full(len(line), floor)])
            canvas.line(camera.line(shadow), SHADE, width)
        canvas.polygon(camera.line([(x, y, 0.0) for x, y in PLATE]), S.STEEL)
        canvas.line(camera.line(planned), S.blend(S.PAPER, S.REFERENCE, 0.35), 2)
        _arm(canvas, camera, plant, info)
        canvas.line(camera.line(path[:3].T), S.REFERENCE, 2.5)
        _tool(canvas, camera, info)
    S.pressure_scale(canvas, _mean_pressure(info), plant.regulator.max_pressure, 276.0, 120.0)
    _numbers(canvas, plant, info)


def _mean_pressure(info: Any) -> float:
    """Return the mean of all pressures [Pa]."""
    pressures = [info[key] for key in info if key.startswith("state/pressure_")]
    return float(sum(pressures) / len(pressures))


def _numbers(canvas: S.Canvas, plant: Any, info: Any) -> None:
    """Write the errors of the tool, and the largest joint angle."""
    largest = max(abs(info[f"state/angle_{k}"]) for k in range(plant.stages))
    rows = [
        ("position error", f"{1e3 * info['output']:.1f} mm"),
        ("pointing error", f"{math.degrees(info['state/pointing_error']):.2f} deg"),
        ("joint error (RMS)", f"{math.degrees(info['state/joint_error']):.2f} deg"),
        ("largest joint angle", f"{math.degrees(largest):.1f} deg"),
    ]
    S.table(canvas, rows, 92, 508)


def _upright(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (3, k) with the height [m] above the base instead of the depth."""
    return path * np.array([[1.0], [1.0], [-1.0]])


def _plan_view(canvas: S.Canvas, env: Any, info: Any, points: S.Trace) -> None:
    """Draw reference path and path of the tip in the plane in which the reference is longest."""
    path, tips = _upright(path_of(env, info)[:3]), _upright(np.array(points).T)
    seen = sorted(np.argsort(np.ptp(path, axis=1))[1:].tolist())
    both = np.hstack([path, tips])
    middle = 0.5 * (both.max(axis=1) + both.min(axis=1))
    ratio = S.PANEL[2] / S.PANEL[3]
    tall = 1.15 * max(np.ptp(both[seen[1]]), np.ptp(both[seen[0]]) / ratio, 0.02)
    sides = (0.5 * tall * ratio, 0.5 * tall)
    spans = [(middle[k] - half, middle[k] + half) for k, half in zip(seen, sides, strict=True)]
    axes = S.Axes(canvas, S.PANEL, *spans)
    across, up = (f"{('x', 'y', 'height')[k]} [m]" for k in seen)
    axes.frame(S.round_ticks(*spans[0]), S.round_ticks(*spans[1]), across, up)
    axes.curve(path[seen].T.tolist(), S.REFERENCE, 2)
    axes.curve(tips[seen].T.tolist(), S.OUTPUT, 2)
    canvas.disc(axes.at(*tips[seen, -1]), 4.5, S.OUTPUT)


OFF_PATH = S.Strip(
    "position error", "mm", 1e3, (("output", S.OUTPUT, 2.0),), 350, 64, (0.0, 100.0), (0, 50, 100)
)


def view(plant: Any) -> S.View:
    """Return the view of an arm."""
    end, n = math.degrees(plant.largest_angle), plant.stages
    lines = [(f"state/joint_reference_{k}", S.REFERENCE, 1.0) for k in range(n)]
    for k in range(n):
        tint = S.blend(S.OUTPUT, (0, 170, 150), k / max(1, n - 1))
        lines.append((f"state/angle_{k}", tint, 1.5))
    name, scale = "joint angles, planned and true", 180.0 / math.pi
    joints = S.Strip(name, "deg", scale, lines, 456, 102, (-end, end), angle_ticks)
    return S.View(
        arm_scene,
        (OFF_PATH, joints),
        JointIntegral,
        number=("mean pressure", "bar", lambda info: 1e-5 * _mean_pressure(info)),
        trace=lambda info: (info["state/x"], info["state/y"], info["state/z"]),
        panel=_plan_view,
    )
