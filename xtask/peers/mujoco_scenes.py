#!/usr/bin/env python3
"""Runs files of piles with MuJoCo, tuned for accuracy, and prints how fast (the output of the example `scenes`).

    python3 mujoco_scenes.py FILE [--dt S] [--repeat N] [--scenes N] [--final OUT.csv]

Needs `pip install mujoco` (its wheel holds the headers) and a C compiler: the loop around mj_step is C, so that no time
is lost in Python.  What is tuned: every pair of bodies has a contact of its own, 1 ms long, whose damping is found
numerically so that it gives the pair's restitution at this step.
"""
import argparse
import math
import os
import pathlib
import subprocess
import tempfile

import mujoco

CONTACT_S = 1e-3
GRAVITY = 9.81


def restitution(stiffness, damping, step):
    """Mean over how deep the first step lands."""
    total, phases = 0.0, [0.1, 0.3, 0.5, 0.7, 0.9]
    for phase in phases:
        place, speed = -phase * step, -1.0
        while True:
            push = -damping * speed - stiffness * place
            if place >= 0 or (push <= 0 and speed > 0):
                break
            speed += step * max(push, 0.0)
            place += step * speed
        total += speed
    return total / len(phases)


def spring(wanted, step, known={}):
    """Stiffness and damping (per unit mass) of a contact of 1 ms with a restitution."""
    key = (round(wanted, 9), step)
    if key not in known:
        low, high = 0.0, 4.0 / CONTACT_S * math.pi
        for _ in range(50):
            damping = 0.5 * (low + high)
            stiffness = (math.pi / CONTACT_S) ** 2 + (damping / 2) ** 2
            low, high = (damping, high) if restitution(stiffness, damping, step) > wanted else (low, damping)
        known[key] = ((math.pi / CONTACT_S) ** 2 + (low / 2) ** 2, low)
    return known[key]


def scenes(path):
    found = []
    for line in open(path):
        words = line.split()
        if words[:1] == ["scene"]:
            found.append({"name": words[2], "bodies": []})
        elif words[:1] == ["striker"]:
            found[-1]["striker"] = [float(w) for w in words[1:]]
        elif words[:1] in (["disc"], ["poly"]):
            found[-1]["bodies"].append((words[0], [float(w) for w in words[1:]]))
    return found


def geom(name, kind, n):
    common = f'name="{name}" contype="0" conaffinity="0"'
    if kind == "disc":
        return "", f'<geom {common} type="sphere" size="{n[7]!r}"/>'
    corners = list(zip(n[10::2], n[11::2]))
    if len(corners) == 4:
        half = [max(abs(c[k]) for c in corners) for k in (0, 1)]
        return "", f'<geom {common} type="box" size="{half[0]!r} {half[1]!r} 0.02"/>'
    points = " ".join(f"{x!r} {y!r} {z}" for z in (-0.02, 0.02) for x, y in corners)
    return f'<mesh name="m{name}" vertex="{points}"/>', f'<geom {common} type="mesh" mesh="m{name}"/>'


def model(scene, step):
    radius, x, y, speed, travel, bounce, rough = scene["striker"]
    meshes, bodies, pairs, grips = [], [], [], []
    surfaces = [("s", bounce, rough)]
    for k, (kind, n) in enumerate(scene["bodies"]):
        mass, friction = n[0], n[1]
        arm, inertia = (n[8], 0.5 * mass * n[7] ** 2) if kind == "disc" else (n[7], n[8])
        mesh, shape = geom(f"g{k}", kind, n)
        meshes.append(mesh)
        bodies.append(
            f'<body pos="{n[4]!r} {n[5]!r} 0" euler="0 0 {n[6]!r}">'
            f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
            f'<joint type="slide" axis="{math.cos(n[6])!r} {-math.sin(n[6])!r} 0"/>'
            f'<joint type="slide" axis="{math.sin(n[6])!r} {math.cos(n[6])!r} 0"/>'
            f'<joint type="hinge" axis="0 0 1"/>{shape}</body>'
        )
        grips += [friction * GRAVITY, friction * GRAVITY * mass * arm / inertia]
        for other, e, f in surfaces:
            stiffness, damping = spring(e * n[2], step)
            mu = f * n[3]
            pairs.append(
                f'<pair geom1="{other}" geom2="g{k}" condim="{3 if mu > 0 else 1}" friction="{mu} {mu} 0.005 0.0001 0.0001"'
                f' solref="{-stiffness!r} {-damping!r}" solimp="0.9999 0.9999 0.001 0.5 2"/>'
            )
        surfaces.append((f"g{k}", n[2], n[3]))
    numbers = " ".join(repr(g) for g in grips)
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false"/>
<option timestep="{step!r}" gravity="0 0 0" cone="elliptic"/>
<custom><numeric name="grip" data="{numbers}"/><numeric name="strike" data="{speed!r} {travel!r}"/></custom>
<asset>{''.join(meshes)}</asset>
<worldbody><body pos="{x!r} {y!r} 0"><inertial pos="0 0 0" mass="1e5" diaginertia="1 1 1"/><joint type="slide" axis="1 0 0"/>
<geom name="s" contype="0" conaffinity="0" type="sphere" size="{radius!r}"/></body>
{''.join(bodies)}</worldbody><contact>{''.join(pairs)}</contact></mujoco>"""


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("file")
    arguments.add_argument("--dt", type=float, default=31.25e-6)
    arguments.add_argument("--repeat", type=int, default=1)
    arguments.add_argument("--scenes", type=int, default=40)
    arguments.add_argument("--final", default=os.devnull)
    a = arguments.parse_args()
    here, wheel = pathlib.Path(__file__).parent, pathlib.Path(mujoco.__file__).parent
    library = next(wheel.glob("libmujoco.so*"))
    with tempfile.TemporaryDirectory() as folder:
        binary = f"{folder}/mujoco_scenes"
        build = ["cc", "-O2", str(here / "mujoco_scenes.c"), "-o", binary, f"-I{wheel / 'include'}", str(library)]
        subprocess.run([*build, f"-Wl,-rpath,{wheel}", "-lm"], check=True)
        command = [binary, repr(a.dt), str(a.repeat), a.final]
        for k, scene in enumerate(scenes(a.file)[: a.scenes]):
            path = f"{folder}/{k}.xml"
            pathlib.Path(path).write_text(model(scene, a.dt))
            command += [scene["name"], path]
        subprocess.run(command, check=True)


main()
