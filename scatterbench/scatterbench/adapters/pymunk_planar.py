"""pymunk (Chipmunk), a physics engine in the plane; joints of limited force to the table are the friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pymunk

from ..table import outline
from ._search import predicted, searched

STEP_S = 1e-3
LONGEST_S = 3.0
SCALE = 1000.0
"""Chipmunk works in millimetres here: its tolerances suit lengths of about 1 to 1000."""
RETRACT_M_S = 0.15


def answer(item: dict[str, Any]) -> Any:
    """Distances and strikes from simulations; pymunk neither sees nor learns."""
    tasks = {"predict": predicted, "plan": searched}
    return tasks[item["task"]](item, final) if item["task"] in tasks else None


def _object(space: pymunk.Space, known: dict[str, Any], pose: Any, mass_kg: float, friction: float) -> tuple[pymunk.Body, pymunk.Shape]:
    """An object, and the joints that slow it down."""
    points = outline(known["shape"]) * SCALE
    is_disc = "disc" in known["shape"]
    radius = known["shape"]["disc"]["radius_m"] * SCALE if is_disc else 0.0
    moment = pymunk.moment_for_circle(mass_kg, 0.0, radius) if is_disc else pymunk.moment_for_poly(mass_kg, points.tolist())
    body = pymunk.Body(mass_kg, moment)
    body.position, body.angle = (pose[0] * SCALE, pose[1] * SCALE), pose[2]
    shape: pymunk.Shape = pymunk.Circle(body, radius) if is_disc else pymunk.Poly(body, points.tolist())
    # A uniform pressure: the lever of a disc is 2/3 of its radius; of a polygon nearly that of the disc of the same area.
    lever = 2.0 / 3.0 * (radius if is_disc else math.sqrt(shape.area / math.pi))
    slide = pymunk.PivotJoint(space.static_body, body, body.position)
    slide.collide_bodies, slide.max_bias, slide.max_force = True, 0.0, friction * mass_kg * 9.81 * SCALE
    turn = pymunk.GearJoint(space.static_body, body, 0.0, 1.0)
    turn.max_bias, turn.max_force = 0.0, friction * mass_kg * 9.81 * SCALE * lever
    space.add(body, shape, slide, turn)
    return body, shape


def final(item: dict[str, Any], strike: dict[str, Any], properties: dict[str, Any]) -> np.ndarray:
    """Final positions of the objects (m)."""
    space = pymunk.Space()
    space.iterations = 30
    names, contact = list(item["place"]), properties["contact_friction"]
    bodies, kinds = [], {}
    for name in names:
        known = item["cell"]["objects"][name]
        body, shape = _object(space, known, item["place"][name], properties["mass_kg"][name], properties["friction"][name])
        bodies.append(body)
        kinds[shape] = name
    striker = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    striker.position = tuple(SCALE * np.array(strike["start_m"]))
    rod = pymunk.Circle(striker, SCALE * item["cell"]["striker"]["radius_m"])
    space.add(striker, rod)

    def before(arbiter: pymunk.Arbiter, _space: Any, _data: Any) -> None:
        a, b = sorted(kinds.get(shape, "striker") for shape in arbiter.shapes)
        hit = b == "striker"
        arbiter.restitution = properties["striker_restitution"][a] if hit else properties["restitution"][f"{a}/{b}"]
        arbiter.friction = contact["striker" if hit else "objects"]

    space.on_collision(pre_solve=before)
    along, travelled = np.array([math.cos(strike["heading_rad"]), math.sin(strike["heading_rad"])]), 0.0
    speed, time_s = strike["speed_m_s"], 0.0
    while time_s < LONGEST_S:
        striker.velocity = tuple(speed * SCALE * along)
        space.step(STEP_S)
        time_s, travelled = time_s + STEP_S, travelled + speed * STEP_S
        if speed > 0.0 and travelled >= strike["travel_m"]:
            speed = -RETRACT_M_S
        elif speed < 0.0 and travelled <= 0.0:
            speed = 0.0
        if speed == 0.0 and all(body.velocity.length < 2.0 for body in bodies):
            break
    return np.array([tuple(body.position) for body in bodies]) / SCALE
