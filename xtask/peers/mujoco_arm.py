#!/usr/bin/env python3
"""Lets MuJoCo move an arm by joint torques alone: python3 mujoco_arm.py URDF IN.json

IN.json: {"joints": [names], "start": [q], "step_s": h, "torques": [[..] for every step], "gravity": [3]}; the arm starts at rest.
Prints one JSON line: the tip's velocity (3, base axes) and the joint angles after the last step.
"""
import json
import re
import sys

import mujoco
import numpy as np

urdf, task = open(sys.argv[1]).read(), json.load(open(sys.argv[2]))
# Keep the massless tip as a body of its own.
urdf = re.sub(r"(<robot[^>]*>)", r'\1<mujoco><compiler fusestatic="false"/></mujoco>', urdf, count=1)
model = mujoco.MjModel.from_xml_string(urdf)
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
model.opt.timestep = task["step_s"]
model.opt.gravity[:] = task["gravity"]
data = mujoco.MjData(model)
places = [model.joint(name).qposadr[0] for name in task["joints"]]
speeds = [model.joint(name).dofadr[0] for name in task["joints"]]
data.qpos[places] = task["start"]
for torques in task["torques"]:
    data.qfrc_applied[speeds] = torques
    mujoco.mj_step(model, data)
mujoco.mj_forward(model, data)
jacobian = np.zeros((3, model.nv))
mujoco.mj_jac(model, data, jacobian, None, data.body("tip").xpos, model.body("tip").id)
print(json.dumps({"velocity": (jacobian @ data.qvel).tolist(), "q": data.qpos[places].tolist()}))
