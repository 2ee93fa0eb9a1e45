"""One strike of the lab filmed by other cameras: rates, tilt, motion blur, noise, dim light, other codings.

    lab_cameras.py LAB OUT

For each camera a folder OUT/NAME with the film, `cell.toml`, `objects.toml`, `campaign.toml` and `truth.json`; what is there
is not filmed again.  LAB is the folder of `lab.py`, whose simulation and rendering do the work.
"""
import json
import os
import shutil
import subprocess
import sys

CLIPS = ["pair_a_d_1"]
# Square `d` is as grey as the table; these two stand out from it.
BARE_CLIPS = ["pair_a_c_1"]
# What differs from the campaign's camera (1080p, 60 frames a second, 1/250 s, noise of 2.5 grey levels); `instants` are
# the moments of an exposure that are averaged.
FILMED = {
    "usual": {},
    "30 per second": {"fps": 30},
    "59.94 per second": {"fps": 59.94},
    "120 per second": {"fps": 120, "shutter": 0.002},
    "tilted 25 degrees": {"pos": [0.02, -0.57, 1.22], "tilt": [0.436, -0.03, 0.01]},
    "blurred by 20 px": {"shutter": 0.016, "instants": 33},
    "noise of 8 levels": {"noise": 8.0},
    "without markers": {"bare": True},
}
# Made of the usual film by ffmpeg.
CODED = {
    "dim": ["-vf", "lutyuv=y=16+(val-16)*0.3", "-c:v", "libx264", "-crf", "16"],
    "HEVC": ["-c:v", "libx265", "-crf", "20", "-x265-params", "log-level=error"],
    "Motion JPEG": ["-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj420p"],
    "10 bits": ["-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p10le"],
}


# Films again: the lab's markers and tags are plates of this thickness (m), and now the files say so.
TOLD = (
    ("tilted 25 degrees", "tilted, thicknesses told", 0.0008, 0.0006),
    ("without markers", "without markers, thickness told", None, 0.0006),
)


def tell(out, film, name, marker_m, tag_m):
    folder = os.path.join(out, name)
    if os.path.exists(os.path.join(folder, "truth.json")):
        return
    shutil.copytree(os.path.join(out, film), folder)
    for file, old, new in (
        ("objects.toml", " }  # black", f", thickness_m = {marker_m} }}  # black"),
        ("cell.toml", "[camera]", f"[camera]\ntag_thickness_m = {tag_m}"),
    ):
        if marker_m is None and file == "objects.toml":
            continue
        path = os.path.join(folder, file)
        with open(path) as text:
            told = text.read().replace(old, new)
        assert new in told, path
        with open(path, "w") as text:
            text.write(told)
    print(name, flush=True)


def main():
    lab_folder, out = sys.argv[1:3]
    sys.path.insert(0, lab_folder)
    import lab
    import mujoco

    class Camera(lab.Camera):
        def __init__(self, spec, rng):
            super().__init__(spec, rng)
            self.instants = spec["camera"].get("instants", 3)

        def shoot(self, world):
            if self.r is None:
                self.r = mujoco.Renderer(world.m, self.h, self.w)
                self.subs = self.instants
            return super().shoot(world)

    lab.Camera = Camera
    with open(os.path.join(lab_folder, "campaign_spec.json")) as file:
        spec = json.load(file)
    known = {clip["name"]: clip for clip in spec["clips"]}
    for name, changes in FILMED.items():
        folder = os.path.join(out, name)
        if os.path.exists(os.path.join(folder, "truth.json")):
            continue
        clips = [known[name] for name in (BARE_CLIPS if changes.get("bare") else CLIPS)]
        other = {**spec, "clips": clips, "camera": {**spec["camera"], **changes}}
        seen = other
        if changes.get("bare"):
            seen = {**other, "objects": {name: {**o, "markers": []} for name, o in spec["objects"].items()}}
        lab.film(seen, folder, None)
        lab.export(other, folder)
        if changes.get("bare"):
            told = os.path.join(folder, "objects.toml")
            with open(told) as file:
                lines = [line for line in file if not line.startswith("marker")]
            with open(told, "w") as file:
                file.writelines(lines)
        print(name, flush=True)
    for name, options in CODED.items():
        folder = os.path.join(out, name)
        if os.path.exists(os.path.join(folder, "truth.json")):
            continue
        os.makedirs(folder, exist_ok=True)
        usual = os.path.join(out, "usual")
        for clip in (known[name] for name in CLIPS):
            film = os.path.join(folder, clip["file"])
            # MP4 holds them all but for old players' sake; the lab's names stay.
            command = ["ffmpeg", "-v", "error", "-y", "-i", os.path.join(usual, clip["file"]), *options, "-f", "mov", film]
            subprocess.run(command, check=True)
        for file in ("cell.toml", "objects.toml", "campaign.toml", "truth.json"):
            shutil.copy(os.path.join(usual, file), folder)
        print(name, flush=True)
    for told in TOLD:
        tell(out, *told)


if __name__ == "__main__":
    main()
