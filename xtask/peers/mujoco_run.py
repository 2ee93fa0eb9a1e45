#!/usr/bin/env python3
"""Runs an exported model from its keyframe `strike` until everything rests: python3 mujoco_run.py MODEL.xml

Prints object,x_m,y_m,yaw_rad of every body but the striker.
"""
import math
import sys

import mujoco

model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("strike").id)
while data.time < 3.0:
    mujoco.mj_step(model, data)
    if data.time > 1.0 and abs(data.qvel).max() < 1e-3:
        break
for body in range(1, model.nbody):
    name, (x, y, _), (w, _, _, z) = model.body(body).name, data.xpos[body], data.xquat[body]
    if name != "striker":
        print(f"{name},{x:.6f},{y:.6f},{2 * math.atan2(z, w):.6f}")
