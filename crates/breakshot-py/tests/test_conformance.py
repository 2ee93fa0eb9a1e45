"""Python and the program give the same text, byte for byte."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from conftest import DEMO

import breakshot


@pytest.fixture(scope="module")
def results(program, tmp_path_factory) -> Path:
    """The program's outputs for the demo."""
    folder = tmp_path_factory.mktemp("program")

    def run(*arguments: object, codes: tuple[int, ...] = (0, 3)) -> None:
        done = subprocess.run([program, *map(str, arguments)], cwd=folder, capture_output=True, text=True)
        assert done.returncode in codes, done.stderr

    scene, strike = DEMO / "pile.scene.toml", DEMO / "pile.strike.json"
    names = "a,c,e"
    run("estimate", DEMO / "campaign.toml", "-o", "properties.json")
    run("simulate", scene, "--properties", "properties.json", "--strike", strike, "-o", "trajectory.json")
    for method in ("robust", "paper"):
        run("plan", scene, "--properties", "properties.json", "--method", method, "-o", f"{method}.json")
    survey = ("--survey", "survey.json", "--survey-strikes", 40, "--survey-samples", 20)
    run("plan", scene, "--properties", "properties.json", *survey, "-o", "surveyed.json")
    film = ("detect", DEMO / "cell.toml", DEMO / "objects.toml")
    run(*film, DEMO / "pile.mp4", "--objects", names, "--scene", scene, "-o", "tracks.json")
    run(*film, DEMO / "single_a_3.mp4", "--objects", "a", "--strike-heading-rad", "-0.02353", "-o", "single.json")
    film = ("verify", scene, DEMO / "pile.mp4")
    run(*film, "--properties", "properties.json", "--strike", strike, "-o", "report")
    return folder


@pytest.fixture(scope="module")
def properties(results) -> breakshot.Properties:
    return breakshot.load_properties(results / "properties.json")


def test_estimate(results, demo_properties):
    assert demo_properties.to_json() == (results / "properties.json").read_text()


def test_simulate(results, demo_scene, properties):
    trajectory = breakshot.simulate(demo_scene, properties, breakshot.load_strike(DEMO / "pile.strike.json"))
    assert trajectory.to_json() == (results / "trajectory.json").read_text()


@pytest.mark.parametrize("method", ["robust", "paper"])
def test_plan(results, demo_scene, properties, method):
    assert breakshot.plan(demo_scene, properties, method=method).to_json() == (results / f"{method}.json").read_text()


def test_survey(results, demo_scene, properties):
    survey = breakshot.survey(demo_scene, properties, strikes=40, samples=20)
    assert survey.to_json() == (results / "survey.json").read_text()


def test_track(results, demo_scene):
    objects = breakshot.load_objects(DEMO / "objects.toml")
    pile = breakshot.track(DEMO / "pile.mp4", demo_scene.cell, objects, ["a", "c", "e"], scene=demo_scene)
    assert pile.to_json() == (results / "tracks.json").read_text()
    cell = breakshot.load_cell(DEMO / "cell.toml")
    single = breakshot.track(DEMO / "single_a_3.mp4", cell, objects, ["a"], strike_heading_rad=-0.02353)
    assert single.to_json() == (results / "single.json").read_text()


def test_verify(results, demo_scene, properties):
    tracks = breakshot.Tracks.from_json((results / "report/tracks.json").read_text())
    strike = breakshot.load_strike(DEMO / "pile.strike.json")
    report = breakshot.verify(demo_scene, properties, strike, tracks)
    assert report.to_json() == (results / "report/report.json").read_text()


def test_command(program, results, properties, demo_scene, tmp_path):
    text = (DEMO / "cell.toml").read_text() + (
        '\n[robot]\narm = "indy7"\nbase_from_table = { position_m = [0.5, 0.0, 0.0], rpy_rad = [0.0, 0.0, 1.5708] }\n'
        "tool_offset_m = [0.0, 0.0, 0.15]\n"
    )
    (tmp_path / "cell.toml").write_text(text)
    strike = {"object": "a", "start_m": [-0.25, 0.03], "heading_rad": 0.0, "speed_m_s": 0.3, "travel_m": 0.08}
    (tmp_path / "strike.json").write_text(breakshot.Strike(**strike).to_json())
    arguments = ["command", "strike.json", "--cell", "cell.toml", "-o", "command.json"]
    done = subprocess.run([program, *arguments], cwd=tmp_path, capture_output=True, text=True)
    answer = breakshot.command(breakshot.load_cell(tmp_path / "cell.toml"), breakshot.Strike(**strike))
    if done.returncode == 0:
        assert answer.to_json() == (tmp_path / "command.json").read_text()
    else:
        assert isinstance(answer, breakshot.Refusal) and answer.reason in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("cell.toml", "[striker]", "[striker]\nspeed = 1.0"),
        ("objects.toml", "height_m", "height_mm"),
        ("pile.scene.toml", 'object = "c"', 'object = "z"'),
    ],
)
def test_errors(program, results, tmp_path, file, old, new):
    for name in ("cell.toml", "objects.toml", "pile.scene.toml"):
        text = (DEMO / name).read_text()
        (tmp_path / name).write_text(text.replace(old, new, 1) if name == file else text)
    arguments = ["plan", "pile.scene.toml", "--properties", results / "properties.json", "-o", "plan.json"]
    done = subprocess.run([program, *arguments], cwd=tmp_path, capture_output=True, text=True)
    with pytest.raises(breakshot.Error) as raised:
        breakshot.load_scene(tmp_path / "pile.scene.toml")
    assert done.returncode == 2
    assert done.stderr.strip() == f"error: {raised.value}".replace(f"{tmp_path}/", "")
