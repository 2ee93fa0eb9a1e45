#!/usr/bin/env python3
"""The vendor's own client against our mock controller: python3 indy_client.py MESSAGES.json

The mock listens on the vendor's ports of this computer.  MESSAGES.json: {name: hex} of what our driver sends.
Prints one JSON line of what was found.
"""
import json
import sys
import time

from neuromeka import IndyDCP3
from neuromeka.proto import common_msgs_pb2 as common
from neuromeka.proto import control_msgs_pb2 as control

MESSAGES = {
    "MoveJointTrajReq": control.MoveJointTrajReq,
    "ForwardKinematicsReq": control.ForwardKinematicsReq,
    "GetMotionLReq": control.GetMotionLReq,
    "StopCat": common.StopCat,
    "Empty": common.Empty,
}


def unlike(name, text):
    """Whether the vendor's class reads other fields from the bytes, or writes them otherwise."""
    raw = bytes.fromhex(text)
    message = MESSAGES[name.split()[0]].FromString(raw)
    again = message.SerializeToString(deterministic=True)
    known = MESSAGES[name.split()[0]].FromString(raw)
    known.DiscardUnknownFields()
    return again != raw or known.SerializeToString(deterministic=True) != raw


with open(sys.argv[1]) as file:
    messages = json.load(file)
indy = IndyDCP3("127.0.0.1")
before = indy.get_control_data()
found = {
    "messages": len(messages),
    "unlike": [name for name, text in messages.items() if unlike(name, text)],
    "op_state": before["op_state"],
    "q_deg": before["q"],
    "p": before["p"],
    "forward": indy.forward_kin(before["q"])["tpos"],
}


def moved(answer):
    end = time.time() + 30
    indy_code = int(answer.get("code", 0))
    while time.time() < end and indy.get_motion_data()["is_in_motion"]:
        time.sleep(0.02)
    return indy_code


target = [q + 5.0 for q in before["q"]]
found["movej_code"] = moved(indy.movej(jtarget=target, vel_ratio=50))
after = indy.get_control_data()
found["movej_off_deg"] = max(abs(a - b) for a, b in zip(after["q"], target))
place = list(after["p"])
place[2] += 20.0
found["movel_code"] = moved(indy.movel(ttarget=place, vel_ratio=20))
found["movel_off_mm"] = max(abs(a - b) for a, b in zip(indy.get_control_data()["p"][:3], place[:3]))
start = [q * 3.141592653589793 / 180 for q in indy.get_control_data()["q"]]
rows = [[q + 1e-5 * k for q in start] for k in range(2000)]
rates = [[0.04] * 6] * 2000
found["traj_code"] = moved(indy.move_joint_traj(rows, rates, [[0.0] * 6] * 2000))
end = [q * 3.141592653589793 / 180 for q in indy.get_control_data()["q"]]
found["traj_off_rad"] = max(abs(a - b) for a, b in zip(end, rows[-1]))
indy.movej(jtarget=before["q"], vel_ratio=1)
time.sleep(0.2)
indy.stop_motion()
still = [indy.get_control_data()["q"] for _ in range(2)]
found["stopped"] = still[0] == still[1] and not indy.get_motion_data()["is_in_motion"]
print(json.dumps(found))
