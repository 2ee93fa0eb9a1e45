#!/usr/bin/env python3
"""What pinocchio says of an arm: python3 pin_arms.py URDF FRAME IN.json

IN.json: {"joints": [names], "rows": [{"q": [..], "qd": [..], "qdd": [..]}]}.  Joints that are not named stand still at zero.
Prints one JSON row for each: tip (3), rotation (9), jacobian (6 n), mass (n n), mobility (9), gravity (n), torques (n).
"""
import json
import sys

import numpy as np
import pinocchio as pin

urdf, frame, task = sys.argv[1], sys.argv[2], json.load(open(sys.argv[3]))
whole = pin.buildModelFromUrdf(urdf)
still = [k for k in range(1, whole.njoints) if whole.names[k] not in task["joints"]]
model = pin.buildReducedModel(whole, still, pin.neutral(whole))
assert list(model.names)[1:] == task["joints"], (list(model.names), task["joints"])
data, tip = model.createData(), model.getFrameId(frame)


def configuration(angles):
    q = pin.neutral(model)
    for joint, angle in zip(list(model.joints)[1:], angles):
        # A joint that turns for ever is held as cosine and sine.
        q[joint.idx_q : joint.idx_q + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
    return q


for row in task["rows"]:
    q, qd, qdd = configuration(row["q"]), np.array(row["qd"]), np.array(row["qdd"])
    jacobian = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED).copy()
    mass = np.triu(pin.crba(model, data, q))
    mass = mass + np.triu(mass, 1).T
    pin.framesForwardKinematics(model, data, q)
    at = data.oMf[tip]
    found = {
        "tip": at.translation,
        "rotation": at.rotation,
        "jacobian": jacobian,
        "mass": mass,
        "mobility": jacobian[:3] @ np.linalg.solve(mass, jacobian[:3].T),
        "gravity": pin.computeGeneralizedGravity(model, data, q).copy(),
        "torques": pin.rnea(model, data, q, qd, qdd).copy(),
    }
    print(json.dumps({name: np.asarray(value).ravel().tolist() for name, value in found.items()}))
