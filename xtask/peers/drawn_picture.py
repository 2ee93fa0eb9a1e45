"""Draws a cell of the lab and takes one picture of its objects, apart from each other: LAB SEED easy|hard FOLDER.

Writes cell.toml, objects.toml, picture.png and poses.json ({name: [x, y, yaw]}) into FOLDER; a picture that is there is kept.
"""
import json
import math
import os
import sys

lab_folder, seed, level, folder = sys.argv[1:]
sys.path.insert(0, lab_folder)
if os.path.exists(os.path.join(folder, "poses.json")):
    sys.exit()
import cells
import cv2
import lab
import numpy as np

spec = cells.draw_cell(int(seed), level == "hard")
spec["clips"] = []
rng = np.random.default_rng([int(seed), 9])
reach = lambda name: float(np.hypot(*lab.outline(spec["objects"][name]["shape"]).T).max()) if spec["objects"][name]["shape"]["type"] != "disc" else spec["objects"][name]["shape"]["radius"]
tags = [(x, y, spec["tags"]["size"] * 10 / 8 * 0.72) for x, y in spec["tags"]["at"]]
while True:
    placed, taken = {}, list(tags)
    for name in spec["objects"]:
        for _ in range(500):
            x, y = rng.uniform(-0.27, 0.27), rng.uniform(-0.15, 0.15)
            r = reach(name)
            if all(math.hypot(x - a, y - b) > r + s + 0.02 for a, b, s in taken):
                placed[name] = [round(x, 5), round(y, 5), round(float(rng.uniform(-math.pi, math.pi)), 5)]
                taken.append((x, y, r))
                break
    if len(placed) == len(spec["objects"]):
        break
# The striker stands far outside the picture.
world = lab.World(spec, placed, [-3.0, 0.0], 0.0, film=True)
lab.mujoco.mj_forward(world.m, world.d)
camera = lab.Camera(spec, rng)
picture = camera.shoot(world)
camera.close()
lab.export(spec, folder)
cv2.imwrite(os.path.join(folder, "picture.png"), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


def centroid(points):
    """The centroid of a polygon's area, about which objects are compared."""
    x, y = np.asarray(points).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    return np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (3 * cross.sum())


poses = {}
for name, (x, y, yaw) in placed.items():
    shape = spec["objects"][name]["shape"]
    at = np.zeros(2) if shape["type"] == "disc" else centroid(lab.outline(shape))
    poses[name] = [x + at[0] * math.cos(yaw) - at[1] * math.sin(yaw), y + at[0] * math.sin(yaw) + at[1] * math.cos(yaw), yaw]
with open(os.path.join(folder, "poses.json"), "w") as file:
    json.dump(poses, file)
