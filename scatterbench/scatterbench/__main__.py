"""`scatterbench run`, `score`, `table`: see `--help`."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from pathlib import Path
from typing import Any

from .adapters import NAMES
from .scoring import markdown, score
from .tasks import SPLITS, TASKS, Split, split


def submission(name: str, data: Split, tasks: list[str]) -> dict[str, Any]:
    """The answers of an adapter to the items of some tasks, and its CPU time."""
    try:
        adapter = importlib.import_module(f"{__package__}.adapters.{name}")
    except ModuleNotFoundError as error:
        raise ValueError(f"{name}: the module `{error.name}` is not installed; needed: what the adapter imports") from None
    answers, cpu_s = {}, {}
    for task in tasks:
        start_s = time.process_time()
        found = {item["id"]: adapter.answer(item) for item in data.items if item["task"] == task}
        answered = {key: value for key, value in found.items() if value is not None}
        if answered:
            answers |= answered
            cpu_s[task] = round(time.process_time() - start_s, 3)
    return {"version": 1, "split": data.name, "method": name, "cpu_s": cpu_s, "answers": answers}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="scatterbench", description="See, learn, predict and plan strikes that scatter piles of objects.")
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="the answers of an adapter, as a submission")
    run.add_argument("adapter", choices=NAMES)
    run.add_argument("-o", "--output", type=Path, required=True)
    judge = commands.add_parser("score", help="the score of submissions; exit code 1 if one fails")
    judge.add_argument("submissions", type=Path, nargs="+")
    both = commands.add_parser("table", help="runs adapters and prints their table; exit code 1 if one fails")
    both.add_argument("adapters", choices=NAMES, nargs="+")
    for command in (run, judge, both):
        command.add_argument("--data", type=Path, help="folder of the items (default: a cache); made if it is not there")
        if command is not judge:
            command.add_argument("--split", choices=SPLITS, default="dev")
            command.add_argument("--tasks", choices=TASKS, nargs="+", default=list(TASKS))
        if command is not run:
            command.add_argument("--json", action="store_true", help="results as JSON")
    return parser


def _scored(arguments: argparse.Namespace) -> int:
    if arguments.command == "table":
        data = split(arguments.split, arguments.data)
        results = [score(submission(name, data, arguments.tasks), data) for name in arguments.adapters]
    else:
        given = [json.loads(path.read_text()) for path in arguments.submissions]
        datas = {one.get("split"): split(str(one.get("split")), arguments.data) for one in given}
        results = [score(one, datas[one["split"]]) for one in given]
    print(json.dumps(results, indent=1) if arguments.json else markdown(results))
    return 0 if all(result["passed"] for result in results) else 1


def main() -> int:
    """The exit code: 0 done, 1 a submission that fails, 2 wrong input."""
    arguments = _parser().parse_args()
    try:
        if arguments.command != "run":
            return _scored(arguments)
        made = submission(arguments.adapter, split(arguments.split, arguments.data), arguments.tasks)
        arguments.output.write_text(json.dumps(made))
        return 0
    except (OSError, ValueError) as error:
        print(f"scatterbench: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
