"""Draws a cell of the lab and simulates its campaign without filming: LAB SEED CLIPS FOLDER.

Writes cell.toml, objects.toml, campaign.toml and truth.json into FOLDER, and camera.json: {"fps": .., "yaw": {object: whether its
marker shows its yaw}}.  The films themselves are empty files: only their names are needed.
"""
import json
import os
import subprocess
import sys

lab, seed, clips, folder = sys.argv[1:]
os.makedirs(folder, exist_ok=True)
if not os.path.exists(os.path.join(folder, "camera.json")):
    spec_path = os.path.join(folder, f"campaign_{seed}.json")
    subprocess.run([sys.executable, os.path.join(lab, "cells.py"), seed, folder, "--clips", clips], check=True, stdout=sys.stderr)
    with open(spec_path) as file:
        spec = json.load(file)
    for clip in spec["clips"]:
        # No film, but each with a content of its own: a campaign refuses a film that is given twice.
        with open(os.path.join(folder, clip["file"]), "w") as film:
            film.write(clip["file"])
    subprocess.run([sys.executable, os.path.join(lab, "lab.py"), "export", spec_path, folder], check=True, stdout=sys.stderr)

    def shows_yaw(thing):
        if thing["shape"]["type"] != "disc":
            return not thing["markers"] or "size" in thing["markers"][0] or "dot" in thing["markers"][0]
        return bool(thing["markers"]) and ("size" in thing["markers"][0] or "dot" in thing["markers"][0])

    with open(os.path.join(folder, "camera.json"), "w") as file:
        json.dump({"fps": spec["camera"]["fps"], "yaw": {n: shows_yaw(o) for n, o in spec["objects"].items()}}, file)
