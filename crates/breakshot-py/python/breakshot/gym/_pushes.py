"""Pushes that free a target, and their rewards.

After Kiatos and Malassiotis, "Robust object grasping in clutter via singulation", ICRA 2019; numbers of the authors' implementation.
"""

from __future__ import annotations

from typing import Any

import numpy as np

DIRECTIONS = 4
"""Headings of a push, from the x axis of the target on."""
PRIMITIVES = 2
"""A push on the target, or along its side."""
PUSHES = 10
"""Most pushes of an episode."""
FREE_M = 0.03
"""Gap to every other object at which the target counts as free (m)."""
PAST_TARGET_M = 0.1
"""How far behind the centre of the target a push ends (m)."""
EMPTY_M = 0.005
"""A push that moves no object by more than this is empty (m)."""
EDGE_M = 0.05
"""Distance from the edge of the workspace within which a target is hard to reach (m)."""
CLEARANCE_M = 0.002
"""Gap between the striker and the target beside which it starts or passes (m)."""

SUCCESS, FAILURE, NEAR_EDGE, PUSH = 10.0, -10.0, -5.0, -1.0
"""Rewards."""

Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]


def push_numbers(poses: Array, radii_m: Array, striker_m: float, run_up_m: float, speed_m_s: float, action: int) -> Array:
    """Start x, y (m), heading (rad), speed (m/s) and travel (m) of a push; the target is the first object."""
    primitive, direction = divmod(action, DIRECTIONS)
    target_m = poses[0, :2]
    heading_rad = poses[0, 2] + direction * 2.0 * np.pi / DIRECTIONS
    along = np.array([np.cos(heading_rad), np.sin(heading_rad)])
    beside_m = radii_m[0] + striker_m + CLEARANCE_M
    if primitive == 0:
        start_m, before_m = target_m, beside_m
    else:
        # From outside the pile, whatever its shape.
        start_m = target_m + beside_m * np.array([-along[1], along[0]])
        before_m = float((np.linalg.norm(poses[:, :2] - start_m, axis=1) + radii_m).max()) + striker_m + run_up_m
    heading_rad = np.arctan2(along[1], along[0])
    return np.array([*(start_m - before_m * along), heading_rad, speed_m_s, before_m + PAST_TARGET_M])


def push_result(before: Array, after: Array, fell: bool, free: bool, workspace: Any) -> tuple[float, bool]:
    """The reward of a push, and whether the episode ends; poses that are not numbers are those of a push that cannot start."""
    moved_m = np.linalg.norm(after[:, :2] - before[:, :2], axis=1)
    low_m, high_m = np.array(workspace["min_m"]), np.array(workspace["max_m"])
    inside_m = np.minimum(after[0, :2] - low_m, high_m - after[0, :2]).min()
    # A comparison with what is no number is false.
    if fell or not (moved_m > EMPTY_M).any() or not inside_m >= 0.0:
        return FAILURE, True
    if free:
        return SUCCESS, True
    return (NEAR_EDGE if inside_m < EDGE_M else PUSH), False
