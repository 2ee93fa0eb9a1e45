"""The examples for many machines: a cluster of several nodes on this machine, one of which is killed while it works."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("ray")
from ray.cluster_utils import Cluster  # noqa: E402

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
DEMO = Path(__file__).resolve().parents[3] / "fixtures" / "demo"
MOST_S = 600.0


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    """A head without cores, and two nodes with one each."""
    # Ray's workers are nicer than all else: on a busy machine they would hardly run.
    monkeypatch.setenv("RAY_worker_niceness", "0")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 100 * 2**20})
    for _ in range(2):
        cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
    cluster.wait_for_nodes()
    yield cluster
    cluster.shutdown()


def run(script: str, arguments: list[str]) -> tuple[int, str]:
    """Exit code and output of an example in one process."""
    command = [sys.executable, str(EXAMPLES / script), *arguments, "--local"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=MOST_S)
    return ended.returncode, ended.stdout


def run_and_kill(cluster: Cluster, script: str, arguments: list[str]) -> tuple[int, str]:
    """The same on the cluster; a node is killed after the first result, and another one added."""
    command = [sys.executable, str(EXAMPLES / script), *arguments, "--address", cluster.address]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = threading.Timer(MOST_S, program.kill)
    deadline.start()
    said = []
    for line in program.stderr:
        said.append(line)
        if " of " in line and line[:1].isdigit():
            break
    assert program.poll() is None, "".join(said)
    [*_, node] = cluster.worker_nodes
    cluster.remove_node(node, allow_graceful=False)
    cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
    results = [line for line in program.stderr if " of " in line and line[:1].isdigit()]
    printed = program.stdout.read()
    code = program.wait()
    deadline.cancel()
    assert len(results) > 2, "nothing was left to do when the node was killed"
    return code, printed


def bits(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_films_are_tracked_once_to_the_bits_of_one_process_and_failures_are_listed(cluster, tmp_path):
    films = tmp_path / "films"
    shutil.copytree(DEMO, films)
    (films / "single_c_3.mp4").write_bytes(b"no film")
    campaign = str(films / "campaign.toml")
    code, printed = run("ray_tracks.py", [campaign, str(tmp_path / "alone")])
    alone = bits(tmp_path / "alone")
    count = len(json.loads(alone["index.json"]))
    assert code == 3 and f"{count + 1} films: {count} tracked, 0 finished before, 1 failed" in printed, printed
    assert list(json.loads(alone["failures.json"])) == ["single_c_3.mp4"] and count == 11

    # As after a run that was interrupted.
    there = tmp_path / "there"
    there.mkdir()
    finished = sorted(json.loads(alone["index.json"]).values())[:3]
    for name in finished:
        shutil.copy(tmp_path / "alone" / name, there / name)
    times = {name: (there / name).stat().st_mtime_ns for name in finished}
    code, printed = run_and_kill(cluster, "ray_tracks.py", [campaign, str(there)])
    assert code == 3 and f"{count + 1} films: " in printed and "1 failed" in printed, printed
    assert {name: data for name, data in bits(there).items() if not name.startswith(".")} == alone
    assert {name: (there / name).stat().st_mtime_ns for name in finished} == times

    code, printed = run("ray_tracks.py", [campaign, str(there)])
    assert f"0 tracked, {count} finished before, 1 failed" in printed, printed


def test_rollouts_have_the_bits_of_one_process(cluster, tmp_path, demo_properties):
    properties = tmp_path / "properties.json"
    properties.write_text(demo_properties.to_json())
    arguments = [str(DEMO / "pile.scene.toml"), str(properties), "--strikes", "62500", "--block", "5000", "--seed", "7"]
    code, alone = run("ray_rollouts.py", arguments)
    assert code == 0 and "digest" in alone, alone
    code, printed = run_and_kill(cluster, "ray_rollouts.py", arguments)
    # Ray reports the loss of a node on the same stream.
    results = [line for line in printed.splitlines() if line.startswith(("heading ", "digest "))]
    assert code == 0 and results == alone.splitlines(), printed
    _, other = run("ray_rollouts.py", [*arguments[:-1], "8"])
    assert other.splitlines()[-1] != alone.splitlines()[-1]
