#!/usr/bin/env python3
"""Our rosbridge messages beside those of roslibpy: python3 rosbridge_layout.py MESSAGES.json

MESSAGES.json: a list of what our driver sent.  For each kind, roslibpy is asked for its own message of the same content, without a
network.  Prints one JSON line: how many kinds were compared, and what differs.
"""
import json
import sys

import roslibpy
from roslibpy.comm.comm import RosBridgeProtocol
from roslibpy.core import MessageEncoder


class Wire(RosBridgeProtocol):
    def send_message(self, payload):
        sent.append(json.loads(payload))


class Ros:
    """As much of a connection as the clients need."""

    id_counter = 1

    def __init__(self):
        self.wire = Wire()

    def send_on_ready(self, message):
        self.wire.send_ros_message(message)

    def call_async_action(self, message, resultback, feedback, errback):
        self.wire.send_ros_action_goal(message, resultback, feedback, errback)

    def on(self, *_):
        pass

    def off(self, *_):
        pass


def theirs(ours):
    """What roslibpy sends for the same content."""
    sent.clear()
    ros, op = Ros(), ours["op"]
    nothing = lambda *_: None
    if op in ("send_action_goal", "cancel_action_goal"):
        kind = ours.get("action_type", "control_msgs/action/FollowJointTrajectory")
        client = roslibpy.ActionClient(ros, ours["action"], kind)
        if op == "send_action_goal":
            client.send_goal(roslibpy.Goal(ours["args"]), nothing, nothing, nothing)
        else:
            client.cancel_goal(ours["id"])
    else:
        types = {"/joint_states": "sensor_msgs/msg/JointState"}
        kind = ours.get("type", types.get(ours["topic"], "trajectory_msgs/msg/JointTrajectory"))
        topic = roslibpy.Topic(ros, ours["topic"], kind, reconnect_on_close=False, queue_size=1, queue_length=0)
        if op == "subscribe":
            topic.subscribe(nothing)
        elif op == "advertise":
            topic.advertise()
        else:
            topic._is_advertised = True
            topic.publish(roslibpy.Message(ours["msg"]))
    return next(message for message in sent if message["op"] == op)


def differences(ours, other, path):
    if isinstance(ours, dict) and isinstance(other, dict):
        found = [f"{path}{key}: only one has it" for key in ours.keys() ^ other.keys()]
        for key in ours.keys() & other.keys():
            found += differences(ours[key], other[key], f"{path}{key}.")
        return found
    # A number of a request is each client's own.
    free = path.endswith("id.") or json.dumps(ours) == json.dumps(other)
    return [] if free else [f"{path} {ours!r} and {other!r}"]


sent, seen, found = [], set(), []
for ours in json.load(open(sys.argv[1])):
    if ours["op"] not in seen:
        seen.add(ours["op"])
        found += differences(ours, theirs(ours), ours["op"] + ".")
print(json.dumps({"kinds": sorted(seen), "differences": found}))
