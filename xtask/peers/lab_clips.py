"""Carries clips out in the lab: LAB SPEC CLIPS FOLDER [--film].

CLIPS is a JSON list of {"name", "placed": [[object, [x, y, yaw]], ..], "striker_start", "heading", "speed", "travel"}.  Writes cell.toml, objects.toml,
campaign.toml and truth.json into FOLDER; without --film the films are empty files, only their names are needed.
"""
import json
import os
import subprocess
import sys

lab, spec_path, clips_path, folder = sys.argv[1:5]
os.makedirs(folder, exist_ok=True)
with open(spec_path) as file:
    spec = json.load(file)
with open(clips_path) as file:
    clips = json.load(file)
for number, clip in enumerate(clips):
    # Friction varies from clip to clip, as in the lab's campaigns.
    scale = [0.97, 1.02, 1.03, 0.99, 0.96, 1.01, 1.04, 0.98][number % 8]
    clip.update({"place": dict(clip.pop("placed")), "file": clip["name"] + ".mp4", "seed": number + 1, "settle": 0.12, "max_time": 1.6, "friction_scale": scale})
path = os.path.join(folder, "spec.json")
with open(path, "w") as file:
    json.dump({**spec, "clips": clips}, file)
if "--film" in sys.argv:
    subprocess.run([sys.executable, os.path.join(lab, "lab.py"), "film", path, folder], check=True, stdout=sys.stderr)
else:
    for clip in clips:
        # No film, but each with a content of its own: a campaign refuses a film that is given twice.
        with open(os.path.join(folder, clip["file"]), "w") as film:
            film.write(clip["file"])
subprocess.run([sys.executable, os.path.join(lab, "lab.py"), "export", path, folder], check=True, stdout=sys.stderr)
