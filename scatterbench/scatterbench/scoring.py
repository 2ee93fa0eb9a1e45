"""The one scoring function: schema, plausibility, losses beside those of chance, bootstrap intervals."""

from __future__ import annotations

import json
import math
import os
from concurrent.futures import ProcessPoolExecutor
from importlib import resources
from typing import Any

import jsonschema
import numpy as np

from .adapters import random
from .table import Table, placed_outline
from .tasks import TASKS, Split, executed

ALPHA = 0.05
"""Intervals have the probability 1 - ALPHA."""
CAP_M = 0.1
"""Largest error of a position; a missing one counts as this."""
START_M = 0.02
"""A position in the first frame is at most so far from the given start."""
FARTHEST_M = 5.0
HEADING_RAD = 2.0 * math.pi
RESAMPLES = 2000
LEAST = 1e-3
"""A property below this counts as this, where logarithms are compared."""
POSSIBLE = {"friction": (0.0, 3.0), "striker_restitution": (0.0, 1.0), "restitution": (0.0, 1.0), "mass_ratio": (1e-3, 1e3)}


class Implausible(ValueError):
    """An answer that cannot be right, whatever the truth is."""


def score(submission: dict[str, Any], data: Split) -> dict[str, Any]:
    """The result of each task: loss, skill with its 95 % interval, measures, verdict.

    Skill is one minus the loss over that of chance (the adapter `random` on the same items): 1 is without error, 0 is chance.  The
    interval is that of the bootstrap over cells.  The verdict is `ok`, `below chance` if the whole interval of the skill is below 0,
    or `implausible: ...`.
    """
    _check_schema(submission)
    if submission["split"] != data.name:
        raise ValueError(f"the submission is for the split `{submission['split']}`; needed: `{data.name}`")
    results = {}
    known = {item["id"] for item in data.items}
    if unknown := sorted(set(submission["answers"]) - known):
        raise ValueError(f"the submission answers `{unknown[0]}`; needed: items of `{data.name}`")
    for task in TASKS:
        items = [item for item in data.items if item["task"] == task]
        answers = {item["id"]: submission["answers"].get(item["id"]) for item in items}
        if all(answer is None for answer in answers.values()):
            continue
        results[task] = _task_result(task, items, answers, data) | {"cpu_s": submission.get("cpu_s", {}).get(task)}
    passed = all(result["verdict"] == "ok" for result in results.values())
    return {"method": submission["method"], "split": data.name, "tasks": results, "passed": passed}


def _check_schema(submission: Any) -> None:
    text = resources.files(__package__).joinpath("submission.schema.json").read_text()
    try:
        json.dumps(submission, allow_nan=False)
        jsonschema.validate(submission, json.loads(text))
    except jsonschema.ValidationError as error:
        where = "/".join(str(part) for part in error.absolute_path) or "the submission"
        raise ValueError(f"{where}: {error.message[:200]}; needed: what submission.schema.json describes") from None
    except (TypeError, ValueError) as error:
        raise ValueError(f"the submission is no JSON ({error}); needed: finite numbers") from None


def _task_result(task: str, items: list[dict[str, Any]], answers: dict[str, Any], data: Split) -> dict[str, Any]:
    try:
        for item in items:
            if answers[item["id"]] is None:
                raise Implausible(f"{item['id']} is not answered; needed: all items of a task, or none")
            _PLAUSIBLE[task](item, answers[item["id"]], data)
    except Implausible as error:
        return {"verdict": f"implausible: {error}", "loss": None, "skill": None, "interval": None, "measures": {}}
    own = _losses(task, items, [answers[item["id"]] for item in items], data)
    if task not in data.chance:
        data.chance[task] = _losses(task, items, [random.answer(item) for item in items], data)
    loss, reference = (np.array([one["loss"] for one in losses]) for losses in (own, data.chance[task]))
    seeds = np.array([item["cell_seed"] for item in items])
    cells = np.unique(seeds)
    sums = np.array([[loss[seeds == cell].sum(), reference[seeds == cell].sum()] for cell in cells])
    draws = sums[np.random.default_rng(1).integers(len(cells), size=(RESAMPLES, len(cells)))].sum(axis=1)
    skills = 1.0 - draws[:, 0] / np.maximum(draws[:, 1], 1e-12)
    low, high = (float(end) for end in np.quantile(skills, [ALPHA / 2.0, 1.0 - ALPHA / 2.0]))
    return {
        "verdict": "below chance" if high < 0.0 else "ok",
        "loss": float(loss.mean()),
        "skill": float(1.0 - loss.sum() / max(reference.sum(), 1e-12)),
        "interval": [low, high],
        "measures": _measures(task, own),
    }


def _interval_loss(answer: list[float], truth: float) -> float:
    """The interval score (Gneiting and Raftery, "Strictly proper scoring rules", 2007, Eq. 43)."""
    low, _, high = answer
    return (high - low) + 2.0 / ALPHA * (max(low - truth, 0.0) + max(truth - high, 0.0))


def _losses(task: str, items: list[dict[str, Any]], answers: list[Any], data: Split) -> list[dict[str, Any]]:
    if task == "plan":
        with ProcessPoolExecutor(max_workers=os.cpu_count()) as pool:
            rates = pool.map(executed, [data.cells[item["cell_seed"]] for item in items], items, answers)
            return [{"loss": 1.0 - rate} for rate in rates]
    return [_LOSS[task](answer, data.truth[item["id"]]) for item, answer in zip(items, answers, strict=True)]


def _see_loss(answer: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    errors, missing = [], 0
    for name, positions in truth.items():
        for found, at in zip(answer[name], positions, strict=True):
            missing += found is None
            errors.append(CAP_M if found is None else min(math.dist(found, at), CAP_M))
    return {"loss": float(np.mean(errors)), "errors": errors, "missing": missing}


def _learn_loss(answer: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    kinds = [kind for kind, values in truth.items() for _ in values]
    rows = [(answer[kind][name], value) for kind, values in truth.items() for name, value in values.items()]
    logs = [([math.log(max(end, LEAST)) for end in interval], math.log(value)) for interval, value in rows]
    return {
        "loss": float(np.mean([_interval_loss(interval, value) for interval, value in logs])),
        "errors": [abs(best - value) / value for (_, best, _), value in rows],
        "covered": [low <= value <= high for (low, _, high), value in rows],
        "kinds": kinds,
    }


def _predict_loss(answer: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    rows = [(answer[pair], value) for pair, value in truth.items()]
    return {
        "loss": float(np.mean([_interval_loss(interval, value) for interval, value in rows])),
        "errors": [abs(best - value) for (_, best, _), value in rows],
        "covered": [low <= value <= high for (low, _, high), value in rows],
    }


_LOSS = {"see": _see_loss, "learn": _learn_loss, "predict": _predict_loss}


def _measures(task: str, losses: list[dict[str, Any]]) -> dict[str, float]:
    """What people compare besides the loss."""
    if task == "plan":
        return {"success": 1.0 - float(np.mean([one["loss"] for one in losses]))}
    errors = np.concatenate([one["errors"] for one in losses])
    if task == "see":
        missing = sum(one["missing"] for one in losses) / len(errors)
        return {"median_mm": 1e3 * float(np.median(errors)), "p95_mm": 1e3 * float(np.quantile(errors, 0.95)), "missing": missing}
    all_covered = np.concatenate([one["covered"] for one in losses])
    covered = float(np.mean(all_covered))
    if task == "learn":
        kinds = np.concatenate([one["kinds"] for one in losses])
        of_kinds = {f"coverage_of_{kind}": float(np.mean(all_covered[kinds == kind])) for kind in dict.fromkeys(kinds.tolist())}
        return {"median_relative_error": float(np.median(errors)), "coverage": covered} | of_kinds
    return {"mean_mm": 1e3 * float(np.mean(errors)), "median_mm": 1e3 * float(np.median(errors)), "coverage": covered}


def _require(holds: bool, message: str) -> None:
    if not holds:
        raise Implausible(message)


def _names(item: dict[str, Any], what: str, found: Any, needed: Any) -> None:
    _require(set(found) == set(needed), f"{item['id']}: {what} has {', '.join(sorted(found))}; needed: {', '.join(sorted(needed))}")


def _ordered(item: dict[str, Any], name: str, answer: list[float], least: float, most: float) -> None:
    low, best, high = answer
    _require(low <= best <= high, f"{item['id']}: {name} is {answer}; needed: low <= best <= high")
    _require(least <= best <= most, f"{item['id']}: {name} is {best:.4g}; needed: from {least:.3g} to {most:.3g}")


def _see_plausible(item: dict[str, Any], answer: dict[str, Any], _: Split) -> None:
    _names(item, "the answer", answer, item["place"])
    for name, positions in answer.items():
        _require(len(positions) == item["frames"], f"{item['id']}: {name} has {len(positions)} frames; needed: {item['frames']}")
        start = next((found for found in positions[:1] if found is not None), None)
        if start is not None:
            off_m = math.dist(start, item["place"][name][:2])
            _require(off_m <= START_M, f"{item['id']}: {name} starts {off_m:.3f} m from where it was put; needed: at most {START_M}")


def _learn_plausible(item: dict[str, Any], answer: dict[str, Any], data: Split) -> None:
    for kind, values in data.truth[item["id"]].items():
        _names(item, kind, answer[kind], values)
        for name, interval in answer[kind].items():
            _ordered(item, f"{kind} of {name}", interval, *POSSIBLE[kind])


def _predict_plausible(item: dict[str, Any], answer: dict[str, Any], data: Split) -> None:
    _names(item, "the answer", answer, data.truth[item["id"]])
    shapes = {name: known["shape"] for name, known in item["cell"]["objects"].items()}
    inner_m = {name: float(np.abs(_side_distances(shape)).min()) for name, shape in shapes.items()}
    for pair, interval in answer.items():
        a, b = pair.split("/")
        # Bodies do not interpenetrate: a hundredth for soft contacts.
        _ordered(item, f"the distance of {pair}", interval, 0.99 * (inner_m[a] + inner_m[b]), FARTHEST_M)


def _side_distances(shape: dict[str, Any]) -> np.ndarray:
    """The distance of each side of a shape from its centroid."""
    points = placed_outline(shape, (0.0, 0.0, 0.0))
    after = np.roll(points, -1, axis=0)
    cross = points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0]
    return cross / np.hypot(*(after - points).T)


def _plan_plausible(item: dict[str, Any], answer: dict[str, Any], data: Split) -> None:
    least, most = item["cell"]["speed_range_m_s"]
    speed, heading = answer["speed_m_s"], answer["heading_rad"]
    _require(least <= speed <= most, f"{item['id']}: the speed is {speed:.4g} m/s; needed: from {least} to {most}")
    _require(abs(heading) <= HEADING_RAD, f"{item['id']}: the heading is {heading:.4g} rad; needed: at most one revolution")
    table = Table(data.cells[item["cell_seed"]], item["place"], answer)
    _require(not table.touched(), f"{item['id']}: the striker starts inside an object; needed: a free start")


_PLAUSIBLE = {"see": _see_plausible, "learn": _learn_plausible, "predict": _predict_plausible, "plan": _plan_plausible}


def markdown(results: list[dict[str, Any]]) -> str:
    """The results of several methods as a table in Markdown."""
    lines = ["| task | method | skill (95 % interval) | measures | CPU time | verdict |", "|---|---|---|---|---|---|"]
    for task in TASKS:
        for result in results:
            if task not in result["tasks"]:
                continue
            row = result["tasks"][task]
            skill = "-" if row["skill"] is None else f"{row['skill']:.2f} ({row['interval'][0]:.2f} to {row['interval'][1]:.2f})"
            measures = ", ".join(_shown(name, value) for name, value in row["measures"].items()) or "-"
            cpu = "-" if row.get("cpu_s") is None else f"{row['cpu_s']:.1f} s"
            lines.append(f"| {task} | {result['method']} | {skill} | {measures} | {cpu} | {row['verdict']} |")
    return "\n".join(lines)


def _shown(name: str, value: float) -> str:
    if name.endswith("_mm"):
        return f"{name.removesuffix('_mm').replace('p95', '95 %')} {value:.1f} mm"
    return f"{name.replace('_', ' ')} {100.0 * value:.{0 if value >= 0.1 or value == 0.0 else 1}f} %"
