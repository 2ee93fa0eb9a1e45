"""How many strikes a second are simulated from Python?

    python rollouts.py                      a pile of four discs
    python rollouts.py S4g.txt              the piles of a file, as the Rust example `scenes` reads it

Prints rollouts a second on one thread and on two, of CPU time and of the clock, and checks that both give the same bits; then those of
two processes of one thread each, which share nothing, and of two that only count: what the machine itself permits.  Each
strike has an offset of its own of up to a micrometre, as in
`cargo run --release --example scenes -- S4g.txt --repeat 2500`, which prints the rate of Rust.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import time
from collections.abc import Callable
from multiprocessing.synchronize import Barrier

import numpy as np
import numpy.typing as npt

import breakshot

STRIKES = 100_000
ROUNDS = 3
COUNT = 10_000_000
PILE = """\
scene four 0
striker 0.015 -0.08424247062849749 -0.009894693908688506 0.6 0.06 0.75 0.0
disc 0.143 0.25 0.9 0.0 0.0 0.0 0.0 0.05 0.03333333333333333
disc 0.112 0.3 0.8 0.0 0.09067325416751028 0.038479685634167794 0.0 0.045 0.03
disc 0.061 0.35 0.7 0.0 0.07718862160585453 -0.05113328468378451 0.0 0.038 0.025333333333333333
disc 0.016 0.4 0.65 0.0 0.16951298403460172 0.03203446206985679 0.0 0.03 0.019999999999999997
end
"""


def exact(value: float) -> dict[str, object]:
    """A property that is known exactly."""
    return {"mean": value, "std": 0.0, "standard_error": 0.0, "interval_95": [value, value], "n": 0}


def world(striker: list[float], discs: list[list[float]]) -> breakshot.World:
    """Discs whose contacts have no friction, and a striker that is lifted after its travel.

    A disc is mass, friction, restitution, contact friction, x, y, yaw, radius and mean distance of the support from the centre.
    """
    names = [str(k) for k in range(len(discs))]
    scene = {
        "cell": {
            "camera": {},
            "scale_px_per_m": 1000.0,
            "workspace": {"min_m": [-10.0, -10.0], "max_m": [10.0, 10.0]},
            "striker": {"shape": {"disc": {"radius_m": striker[0]}}, "height_m": 0.1, "speed_range_m_s": [0.01, 10.0]},
        },
        "objects": [
            {"name": name, "shape": {"disc": {"radius_m": disc[7]}}, "height_m": 0.03} for name, disc in zip(names, discs, strict=True)
        ],
        "placed": [{"object": name, "position_m": disc[4:6], "yaw_rad": disc[6]} for name, disc in zip(names, discs, strict=True)],
        "walls": [],
        "keep_out": [],
        "goal": {},
    }
    bounce = dict(zip(names, (disc[2] for disc in discs), strict=True))
    properties = {
        "version": 1,
        "reference": "0",
        "friction": {name: exact(disc[1]) for name, disc in zip(names, discs, strict=True)},
        "striker_restitution": {name: exact(striker[5] * bounce[name]) for name in names},
        "restitution": {f"{a}/{b}": exact(bounce[a] * bounce[b]) for a in names for b in names if a < b},
        "mass_ratio": {name: exact(disc[0]) for name, disc in zip(names, discs, strict=True)},
        "pair_mass_ratio": {},
        "contact_friction": {"objects": exact(0.0), "striker": exact(0.0)},
    }
    return breakshot.World(
        breakshot.Scene.from_json(json.dumps(scene)),
        breakshot.Properties.from_json(json.dumps(properties)),
        after_strike="lift",
    )


def piles(text: str) -> tuple[list[breakshot.World], npt.NDArray[np.float64]]:
    """The worlds of a file, and start x, start y, heading, speed and travel of the strike on each."""
    worlds, strikes = [], []
    for part in text.split("scene ")[1:]:
        lines = [line.split() for line in part.splitlines()]
        numbers = {kind: [[float(word) for word in line[1:]] for line in lines if line[0] == kind] for kind in ("striker", "disc")}
        if not numbers["disc"] or any(line[0] == "poly" for line in lines):
            sys.exit(f"scene {lines[0]}: needed: discs alone")
        [striker] = numbers["striker"]
        worlds.append(world(striker, numbers["disc"]))
        strikes.append([*striker[1:3], 0.0, *striker[3:5]])
    return worlds, np.array(strikes)


def simulating(text: str, numbers: npt.NDArray[np.float64], together: Barrier) -> None:
    """Simulates on one thread, at the same time as other processes."""
    worlds, _ = piles(text)
    simulator = breakshot.Simulator()
    simulator.rollout(worlds, numbers[:1], threads=1)
    for _ in range(ROUNDS):
        together.wait()
        simulator.rollout(worlds, numbers, threads=1)
        together.wait()


def counting(text: str, numbers: npt.NDArray[np.float64], together: Barrier) -> None:
    """Counts in the interpreter, which needs neither memory nor the package."""
    for _ in range(ROUNDS):
        together.wait()
        sum(range(COUNT))
        together.wait()


Work = Callable[[str, npt.NDArray[np.float64], Barrier], None]


def seconds(processes: int, work: Work, text: str, numbers: npt.NDArray[np.float64]) -> float:
    """Time (clock) in which so many processes each do the work once, best of some rounds."""
    context = multiprocessing.get_context("spawn")
    together = context.Barrier(processes + 1)
    workers = [context.Process(target=work, args=(text, numbers, together)) for _ in range(processes)]
    for worker in workers:
        worker.start()
    best_s = np.inf
    for _ in range(ROUNDS):
        together.wait()
        start_s = time.perf_counter()
        together.wait()
        best_s = min(best_s, time.perf_counter() - start_s)
    for worker in workers:
        worker.join()
    return float(best_s)


def main() -> None:
    """Prints the rates."""
    text = PILE
    if len(sys.argv) > 1:
        with open(sys.argv[1]) as file:
            text = file.read()
    worlds, strikes = piles(text)
    repeats = STRIKES // len(worlds)
    numbers = np.tile(strikes, (repeats, 1, 1))
    golden = np.arange(numbers.shape[0] * numbers.shape[1]) * 0.618_033_988_749_894_9
    numbers[..., 1] += 1e-6 * (2.0 * (golden % 1.0) - 1.0).reshape(numbers.shape[:2])
    simulator = breakshot.Simulator()
    rates, bits = [], set()
    for threads in (1, 2):
        best_s = best_cpu_s = np.inf
        for _ in range(ROUNDS):
            start_s, start_cpu_s = time.perf_counter(), time.process_time()
            rollouts = simulator.rollout(worlds, numbers, threads=threads)
            best_s = min(best_s, time.perf_counter() - start_s)
            best_cpu_s = min(best_cpu_s, time.process_time() - start_cpu_s)
        count = rollouts.impacts.size
        rates.append(count / best_s)
        bits.add(rollouts.poses.tobytes())
        print(f"threads={threads} rollouts_per_cpu_s={count / best_cpu_s:.0f} rollouts_per_s={rates[-1]:.0f}")
    assert len(bits) == 1, "the number of threads changed the result"
    print(f"two threads over one: {rates[1] / rates[0]:.2f}")
    for name, work in {"that simulate": simulating, "that only count": counting}.items():
        one_s, two_s = (seconds(processes, work, text, numbers) for processes in (1, 2))
        print(f"two processes {name} over one: {2.0 * one_s / two_s:.2f}")


if __name__ == "__main__":
    main()
