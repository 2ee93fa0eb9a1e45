"""Draws a cell of the lab and films its campaign: LAB SEED CLIPS easy|hard FOLDER.

Writes cell.toml, objects.toml, campaign.toml, the films and truth.json into FOLDER, and camera.json: {"fps": .., "shutter_s": ..}.
A film takes half a minute to four minutes; one that is already there is kept, so that an interrupted run goes on where it ended, and a cell
that was drawn with fewer clips gets the others.
"""
import json
import os
import subprocess
import sys

lab, seed, clips, level, folder = sys.argv[1:]
os.makedirs(folder, exist_ok=True)
spec_path = os.path.join(folder, f"campaign_{seed}.json")
run = lambda *command: subprocess.run([sys.executable, *command], check=True, stdout=sys.stderr)
camera_path = os.path.join(folder, "camera.json")
momentum_path = os.path.join(folder, "momentum.json")  # of drawn_momentum.py


def read_spec():
    with open(spec_path) as file:
        return json.load(file)


# The first clips of a seed are the same however many are drawn; a campaign has at least this many if the seed has them.
drawn_path = os.path.join(folder, "drawn_clips")
drawn = int(open(drawn_path).read()) if os.path.exists(drawn_path) else None
if drawn is None and os.path.exists(spec_path):
    drawn = len(read_spec()["clips"])
if drawn is None or drawn < int(clips):
    run(os.path.join(lab, "cells.py"), seed, folder, "--clips", clips, f"--{level}")
    with open(drawn_path, "w") as file:
        file.write(clips)
    for path in camera_path, momentum_path:
        if os.path.exists(path):
            os.remove(path)
spec = read_spec()

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
if not os.path.exists(camera_path):
    run(os.path.join(lab, "lab.py"), "export", spec_path, folder)
    with open(camera_path, "w") as file:
        json.dump({"fps": spec["camera"]["fps"], "shutter_s": spec["camera"]["shutter"]}, file)
