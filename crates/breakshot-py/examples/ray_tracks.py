"""The tracks of all films of a campaign, on all machines of a Ray cluster.

    python ray_tracks.py campaign.toml tracks/                      a cluster of this machine alone
    python ray_tracks.py campaign.toml tracks/ --address auto       the cluster that runs (`ray start`)
    python ray_tracks.py campaign.toml tracks/ --local              this process, without Ray

All machines must see the campaign, its films and the folder.  The folder gets one file of tracks for each film, named by a hash of all that
the tracks depend on; a file is whole or absent.  Finished films are skipped, so that a run that was interrupted is continued by the same
command.  `index.json` has the file of each film, `failures.json` the error of each film that has none.  A task whose machine or process is
lost is run again elsewhere; at most a few tasks a core are under way, so that memory does not grow with the number of films.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import os
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import breakshot

TASKS_PER_CORE = 4
"""Films that are under way or wait, for each core of the cluster."""


@dataclass(frozen=True)
class Clip:
    """A film of a campaign."""

    film: Path
    cell: Path
    objects: Path
    names: tuple[str, ...]
    heading_rad: float | None
    scene: Path | None
    frame_rate_hz: float | None

    def name(self) -> str:
        """A hash of all that the tracks of the film depend on but the names of files."""
        digest = hashlib.sha256(f"{breakshot.__version__} {self.names} {self.heading_rad} {self.frame_rate_hz}".encode())
        for path in (self.film, self.cell, self.objects, self.scene):
            if path is not None:
                with path.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
        return digest.hexdigest()[:32] + ".json"


def clips(campaign: Path) -> list[Clip]:
    """The films of a campaign; clips that are tracks already are left out."""
    table = tomllib.loads(campaign.read_text())
    beside = campaign.parent
    return [
        Clip(
            film=beside / clip["video"],
            cell=beside / table["cell"],
            objects=beside / table["objects"],
            names=tuple(clip["objects"]),
            heading_rad=clip.get("strike", {}).get("heading_rad"),
            scene=beside / clip["scene"] if "scene" in clip else None,
            frame_rate_hz=clip.get("frame_rate_hz"),
        )
        for clip in table["clips"]
        if "video" in clip
    ]


def write_whole(path: Path, text: str) -> None:
    """Writes a file whole or not at all."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".", suffix=".part", delete=False) as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(file.name, path)


def track(clip: Clip, folder: Path) -> tuple[str | None, str | None, bool]:
    """Tracks one film: the name of its file or the error, and whether it was tracked now."""
    try:
        name = clip.name()
        if (folder / name).exists():
            return name, None, False
        cell, objects = breakshot.load_cell(clip.cell), breakshot.load_objects(clip.objects)
        scene = None if clip.scene is None else breakshot.load_scene(clip.scene)
        heading_rad = None if scene is not None else clip.heading_rad
        tracks = breakshot.track(
            clip.film, cell, objects, list(clip.names), scene=scene, strike_heading_rad=heading_rad, frame_rate_hz=clip.frame_rate_hz
        )
    except (breakshot.Error, OSError) as error:
        return None, str(error), False
    write_whole(folder / name, tracks.to_json())
    return name, None, True


def on_cluster(address: str | None, work: Callable[..., Any], arguments: list[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """The results of tasks as they end, with their numbers; a task that is lost is run again."""
    ray: Any = importlib.import_module("ray")
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False)
    task = ray.remote(max_retries=-1)(work)
    waiting = list(range(len(arguments)))[::-1]
    running: dict[Any, int] = {}
    while waiting or running:
        most = TASKS_PER_CORE * max(1, int(ray.cluster_resources().get("CPU", 1)))
        while waiting and len(running) < most:
            number = waiting.pop()
            running[task.remote(*arguments[number])] = number
        [done, *_], _ = ray.wait(list(running))
        yield running.pop(done), ray.get(done)


def main() -> None:
    """Tracks what is missing and lists what fails."""
    parser = argparse.ArgumentParser(description="The tracks of all films of a campaign, on all machines of a Ray cluster.")
    parser.add_argument("campaign", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--address", help="the cluster; by default one of this machine alone")
    parser.add_argument("--local", action="store_true", help="this process, without Ray")
    options = parser.parse_args()
    campaign, folder = options.campaign.resolve(), options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    all_clips = clips(campaign)
    tasks: list[tuple[Any, ...]] = [(clip, folder) for clip in all_clips]
    results = enumerate(track(*task) for task in tasks) if options.local else on_cluster(options.address, track, tasks)
    index, failures, tracked = {}, {}, 0
    for number, (name, error, now) in results:
        film = os.path.relpath(all_clips[number].film, campaign.parent)
        tracked += now
        if name is None:
            failures[film] = error
        else:
            index[film] = name
        print(f"{len(index) + len(failures)} of {len(tasks)} films", file=sys.stderr, flush=True)
    for file, content in (("index.json", index), ("failures.json", failures)):
        write_whole(folder / file, json.dumps(content, indent=1, sort_keys=True) + "\n")
    print(f"{len(tasks)} films: {tracked} tracked, {len(index) - tracked} finished before, {len(failures)} failed")
    if failures:
        sys.exit(3)


if __name__ == "__main__":
    main()
