"""The mass ratios that the bodies of a drawn cell themselves show: LAB SPEC OUT.

Runs the clips of the cell's campaign without a camera. For the first impact of two objects in each clip, the velocities of both are fitted over up to
60 ms of free sliding before and after it and extrapolated to its middle, as an estimator does that sees every position without an error. What momentum
the impact exchanges with the table (bodies rock within the impact and after it) is an error of the mass ratio that no camera and no fit can avoid.

Writes [{"clip": .., "pair": [a, b], "log_ratio": of the masses as the velocities show them, "truth": ..}, ..] to OUT.
"""
import json
import math
import os
import sys

import numpy as np

sys.path.insert(0, sys.argv[1])
import lab

SPAN_S = 0.06
CLEAR_S = 0.0007  # of a contact, before and after a slide
MOVING_M_S = 0.01
REST_M_S = 0.005
NEEDED = 20  # steps of a slide


def slide(times, velocities, own, impact, after):
    """The velocity at the middle of the impact by the slide on one side of it; None where that is too short. `own`: contacts of the body."""
    start, end = impact["start"], impact["end"]
    if after:
        low = end + CLEAR_S
        high = min([s for s, e in own if s > low] + [low + SPAN_S]) - CLEAR_S / 2
    else:
        high = start - CLEAR_S / 2
        low = max([e for s, e in own if e < high] + [high - SPAN_S]) + CLEAR_S
    use = (times > low) & (times < high)
    if not after and (np.hypot(*velocities[use].T) < REST_M_S).all():
        return np.zeros(2)
    use &= np.hypot(*velocities.T) > MOVING_M_S
    if use.sum() < NEEDED:
        return None
    middle = (start + end) / 2
    return np.array([np.polyval(np.polyfit(times[use], velocities[use, axis], 1), middle) for axis in range(2)])


def ratio_of(spec, clip):
    world = lab.World(spec, clip["place"], clip["striker_start"], clip["heading"], clip.get("friction_scale", 1.0))
    log, _, hits = lab.run(world, clip["speed"], clip["travel"], settle=clip.get("settle", 0.1), max_time=clip.get("max_time", 1.6))
    impacts = lab.impacts(hits)
    impact = next((i for i in impacts if "striker" not in i["pair"]), None)
    if impact is None or impact["contacts"] > 1:
        return None
    changes = []
    for name in impact["pair"]:
        column = 1 + 6 * world.names.index(name)
        own = [(i["start"], i["end"]) for i in impacts if name in i["pair"]]
        before, after = (slide(log[:, 0], log[:, column + 3:column + 5], own, impact, side) for side in (False, True))
        if before is None or after is None:
            return None
        changes.append((after - before) @ np.array(impact["normal"]))
    a, b = changes
    if a * b >= 0:
        return None
    masses = [spec["objects"][name.split("#")[0]]["mass"] for name in impact["pair"]]
    return {"clip": clip["name"], "pair": impact["pair"], "log_ratio": math.log(-b / a), "truth": math.log(masses[0] / masses[1])}


spec_path, out = sys.argv[2:]
with open(spec_path) as file:
    spec = json.load(file)
ratios = [ratio_of(spec, clip) for clip in spec["clips"] if len(clip["place"]) > 1]
with open(out + ".part", "w") as file:
    json.dump([ratio for ratio in ratios if ratio], file)
os.replace(out + ".part", out)
