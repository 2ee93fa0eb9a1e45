"""A film of a hand-held board before the camera of the lab: LAB SPEC.json SEED FILM, then the options of the lab's board.py.

board.py draws a lens from its seed; here the lens is that of SPEC. Blur, noise and coding stay drawn. A film that is there is kept.
"""
import json
import math
import os
import sys

lab_folder, spec_file, seed, film, *options = sys.argv[1:]
sys.path.insert(0, lab_folder)
if os.path.exists(os.path.splitext(film)[0] + ".truth.json"):
    sys.exit()
import board

with open(spec_file) as file:
    lens = json.load(file)["camera"]
(width, height), drawn = lens["resolution"], board.draw_camera
focal_px = height / 2 / math.tan(math.radians(lens["fovy_deg"]) / 2)


def draw_camera(rng):
    return {
        **drawn(rng),
        "image_size_px": [width, height],
        "focal_px": [focal_px, focal_px],
        "center_px": [(width - 1) / 2, (height - 1) / 2],
        "distortion": lens["distortion"],
    }


board.draw_camera = draw_camera
sys.argv = ["board.py", seed, film, *options]
board.main()
