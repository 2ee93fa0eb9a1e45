"""Draws a cell of the lab and films its campaign: LAB SEED CLIPS easy|hard FOLDER.

Writes cell.toml, objects.toml, campaign.toml, the films and truth.json into FOLDER, and camera.json: {"fps": .., "shutter_s": ..}.
A film takes half a minute to four minutes; one that is already there is kept, so that an interrupted run goes on where it ended.
"""
import json
import os
import subprocess
import sys

lab, seed, clips, level, folder = sys.argv[1:]
os.makedirs(folder, exist_ok=True)
spec_path = os.path.join(folder, f"campaign_{seed}.json")
run = lambda *command: subprocess.run([sys.executable, *command], check=True, stdout=sys.stderr)
if not os.path.exists(spec_path):
    run(os.path.join(lab, "cells.py"), seed, folder, "--clips", clips, f"--{level}")
with open(spec_path) as file:
    spec = json.load(file)

# A film moves to its folder when it is complete.
filming = os.path.join(folder, "filming")
for clip in spec["clips"]:
    if os.path.exists(os.path.join(folder, clip["file"])):
        continue
    partial = os.path.join(filming, clip["file"])
    if os.path.exists(partial):
        os.remove(partial)
    run(os.path.join(lab, "lab.py"), "film", spec_path, filming, "--only", clip["name"])
    os.replace(partial[: -len("mp4")] + "truth.json", os.path.join(folder, clip["name"] + ".truth.json"))
    os.replace(partial, os.path.join(folder, clip["file"]))
if not os.path.exists(os.path.join(folder, "camera.json")):
    run(os.path.join(lab, "lab.py"), "export", spec_path, folder)
    with open(os.path.join(folder, "camera.json"), "w") as file:
        json.dump({"fps": spec["camera"]["fps"], "shutter_s": spec["camera"]["shutter"]}, file)
