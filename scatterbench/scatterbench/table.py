"""The ground truth: a table in MuJoCo, in three dimensions, with free bodies, soft contacts of a millisecond, and a striker.

Objects rest on their rims or corners, may tip, and touch each other and the striker with Coulomb friction.  The striker is a cylinder of
40 kg on a slide joint with a stiff velocity servo.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

STEP_S = 5e-5
SAMPLE_STEPS = 20
"""Steps between two samples of a motion."""
STIFFNESS_S2 = 6e6
"""Of a contact (1/s^2): an impact lasts 1.3 ms or 26 steps, so that its restitution hardly depends on when in a step it begins."""
STRIKER_KG = 40.0
RETRACT_M_S = 0.15
LONGEST_S = 5.0
SETTLE_S = 0.1
"""How long objects that are placed on the table come to rest in its soft contact."""
IMPACTS = 60
"""Impacts whose mean is the restitution: that of a polygon varies by up to 0.06 from impact to impact, so that the mean of so many is known
to 0.008."""
STRIKE_OFFSET_M, PAIR_OFFSET_M = 0.003, 0.012
"""Largest distance from the middle of an object at which the striker, or another object, hits it in the strikes to learn from."""
AFTER_S = 0.005, 0.04
"""Times after an impact between which velocities are read: before, objects hop."""
GRAVITY_M_S2 = 9.81
TIPPED_RAD = math.radians(10.0)
STILL_M_S = 2e-3
STILL_RAD_S = 0.05


def outline(shape: dict[str, Any]) -> np.ndarray:
    """Corners (m) of a shape, counter-clockwise; of a disc 64 points of its rim."""
    if "disc" in shape:
        angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        return shape["disc"]["radius_m"] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.array(shape["polygon"]["points_m"])


def placed_outline(shape: dict[str, Any], pose: Any) -> np.ndarray:
    """The outline at a pose x, y (m), yaw (rad)."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    return outline(shape) @ np.array([[cos, sin], [-sin, cos]]) + np.asarray(pose[:2])


def solref(restitution: float) -> str:
    """Stiffness and damping of a contact from which two bodies part with this fraction of their approach speed."""
    log = -math.log(min(max(restitution, 0.02), 0.98))
    damping = log / math.hypot(math.pi, log)
    return f"{-STIFFNESS_S2} {-2.0 * damping * math.sqrt(STIFFNESS_S2)}"


def _geom(name: str, known: dict[str, Any]) -> tuple[str, str]:
    """A geom, and the mesh that it needs."""
    half = known["height_m"] / 2.0
    common = f'name="{name}" mass="{known["mass_kg"]}"'
    if "disc" in known["shape"]:
        return f'<geom type="cylinder" size="{known["shape"]["disc"]["radius_m"]} {half}" {common}/>', ""
    points = outline(known["shape"])
    vertices = " ".join(f"{x} {y} {z}" for z in (-half, half) for x, y in points)
    return f'<geom type="mesh" mesh="{name}" {common}/>', f'<mesh name="{name}" vertex="{vertices}"/>'


def _pair(a: str, b: str, friction: float, contact: str, solimp: str) -> str:
    sliding = f"{friction} {friction} 0.0001 0.0001 0.0001"
    return f'<pair geom1="{a}" geom2="{b}" condim="3" friction="{sliding}" solref="{contact}" solimp="{solimp}"/>'


class Table:
    """Objects of a drawn cell at their poses, and the striker at the start of a strike."""

    def __init__(self, cell: dict[str, Any], place: dict[str, Any], strike: dict[str, Any], friction_scale: float = 1.0) -> None:
        self.names, self.strike = list(place), strike
        truth, radius_m, height_m = cell["truth"], cell["striker"]["radius_m"], cell["striker"]["height_m"]
        bodies, meshes, pairs = "", "", ""
        for k, name in enumerate(self.names):
            known = cell["objects"][name] | {"mass_kg": truth["mass_kg"][name]}
            geom, mesh = _geom(name, known)
            x, y, yaw = place[name]
            meshes += mesh
            bodies += f'<body name="{name}" pos="{x} {y} {known["height_m"] / 2}" euler="0 0 {yaw}"><freejoint name="{name}"/>{geom}</body>'
            pairs += _pair("table", name, truth["friction"][name] * friction_scale, "0.004 1", "0.95 0.99 0.0005")
            bounce = solref(truth["nominal_restitution"]["striker/" + name])
            pairs += _pair("striker", name, truth["contact_friction"]["striker"], bounce, "0.99 0.99 0.001")
            for other in self.names[k + 1 :]:
                bounce = solref(truth["nominal_restitution"]["/".join(sorted((name, other)))])
                pairs += _pair(name, other, truth["contact_friction"]["objects"], bounce, "0.99 0.99 0.001")
        start = strike["start_m"]
        xml = f"""<mujoco><compiler angle="radian"/>
<option timestep="{STEP_S}" cone="elliptic" impratio="10" gravity="0 0 -{GRAVITY_M_S2}"/>
<asset>{meshes}</asset><worldbody><geom name="table" type="plane" size="2 2 .1"/>
<body pos="{start[0]} {start[1]} {height_m / 2 + 0.002}" euler="0 0 {strike["heading_rad"]}"><joint name="drive" type="slide" axis="1 0 0"/>
<geom name="striker" type="cylinder" size="{radius_m} {height_m / 2}" mass="{STRIKER_KG}"/></body>{bodies}</worldbody>
<contact>{pairs}</contact><actuator><velocity joint="drive" kv="{STRIKER_KG * 400}"/></actuator></mujoco>"""
        self.model = mujoco.MjModel.from_xml_string(xml)
        # The newer collider of convex bodies now and then reports a deep contact of cylinders that are apart.
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_NATIVECCD)
        self.data = mujoco.MjData(self.model)
        joints = [self.model.joint(name) for name in self.names]
        self._positions = [int(self.model.jnt_qposadr[joint.id]) for joint in joints]
        self._speeds = [int(self.model.jnt_dofadr[joint.id]) for joint in joints]
        drive = self.model.joint("drive").id
        self._drive, self._drive_speed = int(self.model.jnt_qposadr[drive]), int(self.model.jnt_dofadr[drive])
        mujoco.mj_forward(self.model, self.data)

    def poses(self) -> np.ndarray:
        """x, y (m), yaw (rad) of each object."""
        rows = []
        for first in self._positions:
            x, y, _, w, i, j, k = self.data.qpos[first : first + 7]
            rows.append((x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))))
        return np.array(rows)

    def tipped(self) -> bool:
        """Whether an object stands on another face than at first."""
        tilts = [self.data.qpos[first + 4 : first + 6] for first in self._positions]
        return any(math.acos(max(-1.0, 1.0 - 2.0 * float(tilt @ tilt))) > TIPPED_RAD for tilt in tilts)

    def velocities(self) -> np.ndarray:
        """Velocity (m/s) along x and y, and yaw rate (rad/s) of each object."""
        return np.array([self.data.qvel[[first, first + 1, first + 5]] for first in self._speeds])

    def moving_along_x(self, name: str, speed_m_s: float) -> Callable[[], float]:
        """Sets an object or the striker in motion along x; the result reads its velocity (m/s) at any later time."""
        speed = self._drive_speed if name == "striker" else self._speeds[self.names.index(name)]
        self.data.ctrl[0] = speed_m_s if name == "striker" else 0.0
        self.data.qvel[speed] = speed_m_s
        return lambda: float(self.data.qvel[speed])

    def put(self, at_rest: np.ndarray, place: dict[str, Any], striker_m: Any) -> None:
        """Puts objects that came to rest (coordinates of MuJoCo, yaws of zero) at other poses, and the striker at another start."""
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self.model.geom("striker").bodyid[0], :2] = striker_m
        self.data.qpos[:] = at_rest
        for first, name in zip(self._positions, self.names, strict=True):
            x, y, yaw = place[name]
            turned = np.zeros(4)
            mujoco.mju_mulQuat(turned, np.array([math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]), at_rest[first + 3 : first + 7])
            self.data.qpos[first : first + 2] = x, y
            self.data.qpos[first + 3 : first + 7] = turned
        self.data.qpos[self._drive] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def _contacts(self, a: str, b: str) -> list[Any]:
        pair = {self.model.geom(a).id, self.model.geom(b).id}
        return [contact for contact in self.data.contact[: self.data.ncon] if {contact.geom1, contact.geom2} == pair and contact.dist < 0.0]

    def touching(self, a: str, b: str) -> bool:
        """Whether two objects, or the striker and an object, touch."""
        return bool(self._contacts(a, b))

    def contact(self, a: str, b: str) -> tuple[np.ndarray, np.ndarray]:
        """Where two bodies touch (m), and the normal there, which points along x; both in the plane of the table."""
        contacts = self._contacts(a, b)
        normal = contacts[0].frame[:2] / np.linalg.norm(contacts[0].frame[:2])
        return np.mean([contact.pos[:2] for contact in contacts], axis=0), math.copysign(1.0, normal[0]) * normal

    def touched(self) -> bool:
        """Whether the striker touches an object."""
        return any(self.touching("striker", name) for name in self.names)

    def step_until(self, is_reached: Callable[[], bool], longest_s: float) -> None:
        """Simulates until a condition holds, at most for this long."""
        for _ in range(round(longest_s / STEP_S)):
            if is_reached():
                break
            mujoco.mj_step(self.model, self.data)

    def run(self, settle_s: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Waits, strikes, draws back and waits for rest: times (s), poses of the objects, positions of the striker by sample."""
        data, speed_m_s = self.data, self.strike["speed_m_s"]
        times, poses, striker = [], [], []
        along = np.array([math.cos(self.strike["heading_rad"]), math.sin(self.strike["heading_rad"])])
        phase, steps, still_s = "wait", 0, 0.0
        while steps * STEP_S < LONGEST_S:
            if steps % SAMPLE_STEPS == 0:
                times.append(steps * STEP_S)
                poses.append(self.poses())
                striker.append(np.asarray(self.strike["start_m"]) + data.qpos[self._drive] * along)
                slow = np.abs(self.velocities()) < [STILL_M_S, STILL_M_S, STILL_RAD_S]
                still_s = still_s + SAMPLE_STEPS * STEP_S if slow.all() and phase in ("back", "done") else 0.0
                if phase == "done" and still_s > 0.05:
                    break
            if phase == "wait" and steps * STEP_S >= settle_s:
                phase, data.ctrl[0], data.qvel[self._drive_speed] = "strike", speed_m_s, speed_m_s
            elif phase == "strike" and data.qpos[self._drive] >= self.strike["travel_m"]:
                phase, data.ctrl[0] = "back", -RETRACT_M_S
            elif phase == "back" and data.qpos[self._drive] <= -0.02:
                phase, data.ctrl[0] = "done", 0.0
            mujoco.mj_step(self.model, data)
            steps += 1
        return np.array(times), np.array(poses), np.array(striker)


def final(cell: dict[str, Any], place: dict[str, Any], strike: dict[str, Any], friction_scale: float = 1.0) -> tuple[np.ndarray, bool]:
    """Final poses of the objects in the order of `place`, and whether none tipped."""
    table = Table(cell, place, strike, friction_scale)
    table.run()
    return table.poses(), not table.tipped()


def goal_holds(cell: dict[str, Any], goal: dict[str, Any], poses: np.ndarray) -> bool:
    """Whether all objects are apart and inside the workspace."""
    low, high = np.array(cell["workspace"])
    distances = np.array([np.hypot(*(a - b)) for k, a in enumerate(poses[:, :2]) for b in poses[:k, :2]])
    inside = ((poses[:, :2] >= low) & (poses[:, :2] <= high)).all()
    least, most = goal["mean_distance_m"]
    return bool(inside and distances.min() >= goal["min_distance_m"] and least <= distances.mean() < most)


def measured_restitution(cell: dict[str, Any], a: str, b: str) -> float:
    """The restitution (Newton) of objects, or of the striker and an object, on the table: the mean of impacts drawn as those of strikes.

    It is that of the motion in the plane: the ratio of the normal velocities of both bodies where they touch, after over before.
    Velocities after the impact are extrapolated back to it, and the striker moves as commanded.  In this engine it is larger for an
    impact beside the middle of a body than for a central one, so that its distribution is skewed; the mean is what strikes show.
    """
    rng, values = np.random.default_rng(0), []
    offset_m = STRIKE_OFFSET_M if a == "striker" else PAIR_OFFSET_M
    names = [b] if a == "striker" else [b, a]
    start = {"start_m": [-0.8, 0.0], "heading_rad": 0.0, "speed_m_s": 0.3, "travel_m": 1.0}
    table = Table(cell, {name: [0.3 * k, 0.0, 0.0] for k, name in enumerate(names)}, start)
    table.step_until(lambda: False, SETTLE_S)
    at_rest = table.data.qpos.copy()
    for speed_m_s in np.linspace(0.3, 0.8, IMPACTS):
        yaw_a, yaw_b = rng.uniform(-math.pi, math.pi, 2)
        across_m = float(rng.uniform(-offset_m, offset_m))
        left_m = placed_outline(cell["objects"][b]["shape"], (0.0, 0.0, yaw_b))[:, 0].min() - 0.001
        place, striker_m = {b: [0.0, 0.0, yaw_b]}, [-0.8, across_m]
        if a == "striker":
            striker_m[0] = left_m - cell["striker"]["radius_m"]
        else:
            place[a] = [left_m - placed_outline(cell["objects"][a]["shape"], (0.0, 0.0, yaw_a))[:, 0].max(), across_m, yaw_a]
        table.put(at_rest, place, striker_m)
        values.append(_restitution(table, a, b, float(speed_m_s)))
    return float(np.mean(values))


def _restitution(table: Table, a: str, b: str, speed_m_s: float) -> float:
    """The restitution of one impact of `a`, which moves along x, on `b`."""
    table.moving_along_x(a, speed_m_s)
    approach = table.velocities()

    def touching() -> bool:
        """Whether they touch.  The step that finds a contact contains its force: the approach is that of the step before."""
        nonlocal approach
        if table.touching(a, b):
            return True
        approach = table.velocities()
        return False

    table.step_until(touching, 0.2)
    point, normal = table.contact(a, b)
    levers = [point - pose[:2] for pose in table.poses()]

    def normal_m_s(velocities: np.ndarray) -> float:
        """Of `b` relative to `a`, where they touched."""
        at = {"striker": speed_m_s * normal[0]}
        for name, (x, y, turning), lever in zip(table.names, velocities, levers, strict=True):
            at[name] = float(np.dot(normal, (x - turning * lever[1], y + turning * lever[0])))
        return at[b] - at[a]

    times, rows = [], []
    table.step_until(lambda: False, AFTER_S[0])
    if a == "striker":
        table.data.ctrl[0] = -RETRACT_M_S
    while (time_s := AFTER_S[0] + len(rows) * SAMPLE_STEPS * STEP_S) <= AFTER_S[1]:
        times.append(time_s)
        rows.append(table.velocities().ravel())
        table.step_until(lambda: False, SAMPLE_STEPS * STEP_S)
    at_impact = np.polyfit(times, np.array(rows), 1)[1]
    return -normal_m_s(at_impact.reshape(-1, 3)) / normal_m_s(approach)
