"""MuJoCo as somebody would set it up who does not know how the ground truth is made: steps of 0.5 ms and contacts of 5 ms."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from ..table import outline
from ._search import predicted, searched

STEP_S = 5e-4
CONTACT_S = 5e-3
LONGEST_S = 3.0


def answer(item: dict[str, Any]) -> Any:
    """Distances and strikes from simulations; MuJoCo neither sees nor learns."""
    tasks = {"predict": predicted, "plan": searched}
    return tasks[item["task"]](item, final) if item["task"] in tasks else None


def _solref(restitution: float) -> str:
    """Stiffness and damping of a contact of CONTACT_S with this restitution."""
    log = -math.log(min(max(restitution, 0.05), 0.95))
    ratio, stiffness = log / math.hypot(math.pi, log), (math.pi / CONTACT_S) ** 2
    return f"{-stiffness} {-2.0 * ratio * math.sqrt(stiffness)}"


def _pair(a: str, b: str, friction: float, solref: str) -> str:
    return f'<pair geom1="{a}" geom2="{b}" condim="3" friction="{friction} {friction} .001 .001 .001" solref="{solref}"/>'


def _model(item: dict[str, Any], strike: dict[str, Any], properties: dict[str, Any]) -> str:
    bodies, meshes, pairs, names = "", "", "", list(item["place"])
    contact = properties["contact_friction"]
    for k, name in enumerate(names):
        known, (x, y, yaw), mass = item["cell"]["objects"][name], item["place"][name], properties["mass_kg"][name]
        half = known["height_m"] / 2.0
        if "disc" in known["shape"]:
            form = f'type="cylinder" size="{known["shape"]["disc"]["radius_m"]} {half}"'
        else:
            points = " ".join(f"{px} {py} {z}" for z in (-half, half) for px, py in outline(known["shape"]))
            meshes += f'<mesh name="{name}" vertex="{points}"/>'
            form = f'type="mesh" mesh="{name}"'
        geom = f'<geom name="{name}" mass="{mass}" {form}/>'
        bodies += f'<body pos="{x} {y} {half}" euler="0 0 {yaw}"><freejoint name="{name}"/>{geom}</body>'
        pairs += _pair("table", name, properties["friction"][name], "0.01 1")
        pairs += _pair("striker", name, contact["striker"], _solref(properties["striker_restitution"][name]))
        for other in names[k + 1 :]:
            pairs += _pair(name, other, contact["objects"], _solref(properties["restitution"]["/".join(sorted((name, other)))]))
    striker, (x, y) = item["cell"]["striker"], strike["start_m"]
    half = striker["height_m"] / 2.0
    return f"""<mujoco><compiler angle="radian"/><option timestep="{STEP_S}" cone="elliptic" impratio="10"/>
<asset>{meshes}</asset><worldbody><geom name="table" type="plane" size="2 2 .1"/>
<body pos="{x} {y} {half + 0.002}" euler="0 0 {strike["heading_rad"]}"><joint name="drive" type="slide" axis="1 0 0"/>
<geom name="striker" type="cylinder" size="{striker["radius_m"]} {half}" mass="50"/></body>{bodies}</worldbody>
<contact>{pairs}</contact><actuator><velocity joint="drive" kv="20000"/></actuator></mujoco>"""


def final(item: dict[str, Any], strike: dict[str, Any], properties: dict[str, Any]) -> np.ndarray:
    """Final positions of the objects (m)."""
    model = mujoco.MjModel.from_xml_string(_model(item, strike, properties))
    # The newer collider of convex bodies now and then reports a deep contact of cylinders that are apart.
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_NATIVECCD)
    data = mujoco.MjData(model)
    drive = model.joint("drive").id
    at, speed = model.jnt_qposadr[drive], model.jnt_dofadr[drive]
    data.ctrl[0] = data.qvel[speed] = strike["speed_m_s"]
    while data.time < LONGEST_S:
        mujoco.mj_step(model, data, 20)
        if data.qpos[at] >= strike["travel_m"]:
            data.ctrl[0] = -0.15
        elif data.qpos[at] <= 0.0 and data.ctrl[0] < 0.0:
            data.ctrl[0] = 0.0
            if np.abs(data.qvel).max() < 0.01:
                break
    joints = [model.jnt_qposadr[model.joint(name).id] for name in item["place"]]
    return np.array([data.qpos[joint : joint + 2] for joint in joints])
