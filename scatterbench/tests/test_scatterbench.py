"""The benchmark judges itself: its physics, its films, its scores, and mistakes that it has to find."""

from __future__ import annotations

import copy
import math
from pathlib import Path

import numpy as np
import pytest

import scatterbench
from scatterbench import adapters, cells, films, score, split
from scatterbench.__main__ import submission
from scatterbench.scoring import _interval_loss
from scatterbench.table import GRAVITY_M_S2, SAMPLE_STEPS, SETTLE_S, STEP_S, Table
from scatterbench.tasks import DATA_VERSION, TASKS, _cell_data


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="session")
def data(folder: Path) -> scatterbench.Split:
    return split("tiny", folder)


def of_task(data: scatterbench.Split, task: str) -> scatterbench.Split:
    return scatterbench.Split(data.name, [item for item in data.items if item["task"] == task], data.truth, data.cells)


@pytest.fixture(scope="session")
def right(data: scatterbench.Split) -> dict:
    """A submission of the truth, with intervals of one per cent."""

    def narrow(value: float) -> list[float]:
        return [0.995 * value, value, 1.005 * value]

    answers: dict = {}
    for item in data.items:
        truth = data.truth[item["id"]]
        if item["task"] == "see":
            answers[item["id"]] = truth
        elif item["task"] == "learn":
            answers[item["id"]] = {kind: {name: narrow(value) for name, value in values.items()} for kind, values in truth.items()}
        elif item["task"] == "predict":
            answers[item["id"]] = {pair: narrow(value) for pair, value in truth.items()}
    return {"version": 1, "split": "tiny", "method": "truth", "answers": answers}


def test_a_free_slide_decelerates_by_friction_times_gravity() -> None:
    drawn = cells.cell(2)
    for name, friction in drawn["truth"]["friction"].items():
        table = Table(drawn, {name: [0.0, 0.0, 0.3]}, {"start_m": [-1.0, 0.0], "heading_rad": 0.0, "speed_m_s": 0.1, "travel_m": 0.01})
        table.moving_along_x(name, 0.6)
        _, poses, _ = table.run()
        speed = np.hypot(*np.diff(poses[:, 0, :2], axis=0).T) / (SAMPLE_STEPS * STEP_S)
        # From 20 ms on, until it is slow.
        sliding = np.flatnonzero(speed > 0.1)[20:]
        deceleration = -np.polyfit(sliding * SAMPLE_STEPS * STEP_S, speed[sliding], 1)[0]
        assert abs(deceleration / (friction * GRAVITY_M_S2) - 1.0) < 0.02, (name, deceleration / GRAVITY_M_S2, friction)


def test_a_disc_that_is_struck_slides_as_far_as_its_restitution_and_friction_let_it() -> None:
    drawn = cells.cell(2)
    [name, *_] = [name for name, known in drawn["objects"].items() if "disc" in known["shape"]]
    radius_m = drawn["objects"][name]["shape"]["disc"]["radius_m"] + drawn["striker"]["radius_m"]
    found = []
    for speed_m_s in (0.3, 0.45, 0.6):
        strike = {"start_m": [-radius_m - 0.03, 0.0], "heading_rad": 0.0, "speed_m_s": speed_m_s, "travel_m": 0.042}
        table = Table(drawn, {name: [0.0, 0.0, 0.0]}, strike)
        table.run(SETTLE_S)
        slid_m = float(table.poses()[0, 0])
        left_m_s = math.sqrt(2.0 * drawn["truth"]["friction"][name] * GRAVITY_M_S2 * slid_m)
        found.append(left_m_s / speed_m_s - 1.0)
    assert abs(np.mean(found) - drawn["truth"]["striker_restitution"][name]) < 0.01, found


def test_settled_objects_that_are_put_elsewhere_stay_there() -> None:
    drawn = cells.cell(2)
    strike = {"start_m": [-0.8, 0.0], "heading_rad": 0.0, "speed_m_s": 0.3, "travel_m": 1.0}
    table = Table(drawn, {"b": [0.3, 0.0, 0.0], "c": [0.0, 0.0, 0.0]}, strike)
    table.step_until(lambda: False, SETTLE_S)
    place = {"b": [0.1, -0.2, 2.0], "c": [-0.1, 0.05, -1.0]}
    table.put(table.data.qpos.copy(), place, [-0.5, 0.1])
    for _ in range(2):
        np.testing.assert_allclose(table.poses(), list(place.values()), atol=2e-5)
        table.step_until(lambda: False, 0.02)


def test_a_marker_is_seen_where_the_camera_projects_it() -> None:
    drawn, rng = cells.cell(1), np.random.default_rng(3)
    matrix = films.camera(rng)
    pose = np.array([[[0.1, -0.07, 0.4]]])
    motion = (np.array([0.0, 0.03]), np.repeat(pose, 2, axis=0), np.full((2, 2), -0.4))
    picture = films.frames(drawn, ["a"], matrix, motion, rng)[0].astype(float)
    dark = np.argwhere(picture < 90.0)[:, ::-1]
    dark = dark[np.linalg.norm(dark - dark.mean(axis=0), axis=1) < 12.0]
    weights = 215.0 - picture[dark[:, 1], dark[:, 0]]
    [expected] = films.project(matrix, pose[0, :, :2], drawn["objects"]["a"]["height_m"])
    assert np.abs(np.average(dark, axis=0, weights=weights) - expected).max() < 0.15


def test_the_interval_score_is_the_published_one() -> None:
    assert _interval_loss([1.0, 1.5, 2.0], 1.2) == pytest.approx(1.0)
    assert _interval_loss([1.0, 1.5, 2.0], 2.5) == pytest.approx(1.0 + 40.0 * 0.5)


def test_data_are_made_to_the_same_bit_again(folder: Path, data: scatterbench.Split, tmp_path: Path) -> None:
    again = _cell_data(1, tmp_path)
    assert again["truth"] == {key: data.truth[key] for key in again["truth"]}
    first = next(item for item in again["items"] if item["task"] == "see")
    assert Path(first["film"]).read_bytes() == (folder / f"v{DATA_VERSION}" / Path(first["film"]).name).read_bytes()


def test_chance_has_no_skill_and_the_truth_nearly_all(data: scatterbench.Split, right: dict) -> None:
    chance = score(submission("random", of_task(data, "learn"), ["learn"]), data)
    assert chance["tasks"]["learn"]["skill"] == 0.0 and chance["passed"]
    result = score(right, data)
    assert result["passed"]
    assert {task: row["skill"] > 0.9 for task, row in result["tasks"].items()} == {"see": True, "learn": True, "predict": True}
    assert result["tasks"]["learn"]["measures"]["coverage_of_striker_restitution"] == 1.0


def test_the_wrong_adapter_fails_in_every_task(data: scatterbench.Split) -> None:
    result = score(submission("wrong", data, list(TASKS)), data)
    verdicts = {task: row["verdict"].split(":")[0] for task, row in result["tasks"].items()}
    assert verdicts == {"see": "implausible", "learn": "below chance", "predict": "below chance", "plan": "implausible"}
    assert not result["passed"]


def _edited(right: dict, task: str, edit) -> dict:
    wrong = copy.deepcopy(right)
    for key in [key for key in wrong["answers"] if not key.startswith(task)]:
        del wrong["answers"][key]
    for answer in wrong["answers"].values():
        edit(answer)
    return wrong


def _scaled(kind: str, factor: float):
    def edit(answer: dict) -> None:
        answer[kind] = {name: [factor * end for end in interval] for name, interval in answer[kind].items()}

    return edit


def _millimetres(answer: dict) -> None:
    for pair in answer:
        answer[pair] = [1e3 * end for end in answer[pair]]


def _one_frame_less(answer: dict) -> None:
    for positions in answer.values():
        positions.pop()


def _reversed_interval(answer: dict) -> None:
    for pair in answer:
        answer[pair].reverse()


@pytest.mark.parametrize(
    ("task", "edit", "found"),
    [
        ("see", _one_frame_less, "frames; needed"),
        ("see", lambda answer: answer.pop(next(iter(answer))), "the answer has"),
        ("learn", _scaled("friction", 0.25), "below chance"),
        ("learn", _scaled("restitution", 100.0), "restitution of"),
        ("predict", _millimetres, "the distance of"),
        ("predict", _reversed_interval, "low <= best <= high"),
    ],
)
def test_a_classical_mistake_is_named(data: scatterbench.Split, right: dict, task: str, edit, found: str) -> None:
    result = score(_edited(right, task, edit), data)
    assert found in result["tasks"][task]["verdict"]


@pytest.mark.parametrize(
    ("edit", "found"),
    [
        (lambda s: s["answers"].update({"see-1-0": {"a": [[math.nan, 0.0]]}}), "finite numbers"),
        (lambda s: s["answers"].update({"see-1-0": {"a": [[1.0]]}}), "answers/see-1-0/a/0"),
        (lambda s: s["answers"].update({"see-999-0": {}}), "`see-999-0`"),
        (lambda s: s.update(split="dev"), "`dev`"),
        (lambda s: s.update(note="x"), "'note' was unexpected"),
    ],
)
def test_what_is_no_submission_is_an_error_that_names_it(data: scatterbench.Split, right: dict, edit, found: str) -> None:
    wrong = copy.deepcopy(right)
    edit(wrong)
    with pytest.raises(ValueError, match=found):
        score(wrong, data)


def test_a_strike_that_starts_inside_an_object_is_implausible(data: scatterbench.Split) -> None:
    items = [item for item in data.items if item["task"] == "plan"]
    strike = {"heading_rad": 0.0, "speed_m_s": 0.5, "travel_m": 0.1}
    answers = {item["id"]: strike | {"start_m": next(iter(item["place"].values()))[:2]} for item in items}
    result = score({"version": 1, "split": "tiny", "method": "inside", "answers": answers}, data)
    assert "starts inside an object" in result["tasks"]["plan"]["verdict"]


def test_adapters_have_at_most_a_hundred_lines() -> None:
    lengths = {path.name: len(path.read_text().splitlines()) for path in Path(adapters.__file__).parent.glob("*.py")}
    assert {name: length for name, length in lengths.items() if length > 100} == {}
