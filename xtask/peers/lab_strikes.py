"""Carries strikes out in the lab: one request a line on stdin, one answer a line on stdout.

usage: python3 lab_strikes.py LAB SPEC

LAB is the folder with lab.py and clusters.py, SPEC the cell.  Requests (JSON):

    {"piles": COUNT, "seed": N}                        answer: a list of {"name": .., "place": {name: [x, y, yaw]}}
    {"place": {..}, "strike": {start, heading, speed, travel}, "seed": N or null}
                                                       answer: {"final": {..}, "min_distance", "mean_distance", "max_tilt_deg"}

With a seed the strike is carried out as a robot would: poses off by 1 mm, speed by 2 %, heading by 1 degree (one
standard deviation each).  Friction varies from strike to strike as in the lab's films, where the request gives a
`friction_scale`.
"""
import contextlib
import io
import json
import math
import sys

sys.path.insert(0, sys.argv[1])
import numpy as np  # noqa: E402

import clusters  # noqa: E402
import lab  # noqa: E402


def piles(spec, count, seed):
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        size = 2 + k % min(5, len(spec["objects"]) - 1)
        names = list(rng.choice(list(spec["objects"]), size=size, replace=False))
        found.append({"name": f"pile_{k:03d}", "place": clusters.cluster(spec, names, rng)})
    return found


def perturbed(request):
    rng = np.random.default_rng(request["seed"])
    place = {n: [x + rng.normal(0, 1e-3), y + rng.normal(0, 1e-3), yaw] for n, (x, y, yaw) in request["place"].items()}
    strike = dict(request["strike"])
    strike["speed"] *= 1 + rng.normal(0, 0.02)
    strike["heading"] += rng.normal(0, math.radians(1))
    return {**request, "place": place, "strike": strike}


def answer(spec, request):
    if "piles" in request:
        return piles(spec, request["piles"], request["seed"])
    if request.get("seed") is not None:
        request = perturbed(request)
    try:
        return lab.strike(spec, request)
    except SystemExit as refused:
        return {"refused": str(refused)}


def main():
    spec, out = json.load(open(sys.argv[2])), sys.stdout
    for line in sys.stdin:
        with contextlib.redirect_stdout(io.StringIO()):
            found = answer(spec, json.loads(line))
        print(json.dumps(found), file=out, flush=True)


main()
