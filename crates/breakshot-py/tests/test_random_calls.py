"""Whatever the arguments: an answer or an exception, never a panic or the end of the process."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

import breakshot

CALLS = int(os.environ.get("BREAKSHOT_RANDOM_CALLS", "100000"))
EXPECTED = (ValueError, TypeError, OverflowError, MemoryError, AttributeError)
STRIKE = np.array([-0.3, 0.0, 0.0, 0.6, 0.3])
NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, math.nan, math.inf, -math.inf, 0.5, 20.0, 2**63, -(2**63), 10**30]


class Arguments:
    """Random arguments, the plausible ones among them."""

    def __init__(self, seed: int, worlds: list[breakshot.World]) -> None:
        self.rng = np.random.default_rng(seed)
        self.worlds = worlds

    def choose(self, *choices):
        return choices[self.rng.integers(len(choices))]()

    def number(self):
        return self.choose(lambda: NUMBERS[self.rng.integers(len(NUMBERS))], self.rng.normal)

    def shape(self) -> tuple[int, ...]:
        return tuple(self.rng.choice([0, 1, 2, 3, 4, 5], size=self.rng.integers(0, 5)))

    def array(self):
        def spoilt() -> np.ndarray:
            strikes = np.tile(STRIKE, (*self.shape()[:2], 1))
            if strikes.size:
                strikes.flat[self.rng.integers(strikes.size)] = float(self.number())
            return strikes

        def read_only() -> np.ndarray:
            array = np.tile(STRIKE, (3, 1))
            array.flags.writeable = False
            return array

        return self.choose(
            spoilt,
            read_only,
            lambda: self.rng.normal(size=self.shape()),
            lambda: np.full(self.shape(), self.number(), dtype=object),
            lambda: self.rng.integers(-5, 5, size=(*self.shape(), 5)).astype(self.rng.choice(["i1", "f4", ">f8", "c16", "S3", "?"])),
            lambda: np.broadcast_to(STRIKE, (10 ** self.rng.integers(9, 15), 5)),
            lambda: np.lib.stride_tricks.as_strided(STRIKE, (3, 5), (0, 8)),
            lambda: np.frombuffer(b"\0" + STRIKE.tobytes() + bytes(7), dtype="f8", count=5, offset=1),
            lambda: np.tile(STRIKE, (4, 2))[::-1, ::-2],
            lambda: np.float64(self.number()) if abs(float(self.number())) < 1e9 else np.array(3.0),
        )

    def thing(self):
        return self.choose(
            self.number,
            self.array,
            lambda: None,
            lambda: "a",
            lambda: [self.number()] * int(self.rng.integers(6)),
            lambda: {"object": "a", "start_m": [self.number(), 0.0]},
            lambda: self.worlds[self.rng.integers(len(self.worlds))],
            lambda: np.array(self.worlds, dtype=object)[: self.rng.integers(3)],
            lambda: object(),
            lambda: b"\xff\x00",
        )

    def likely_world(self):
        return self.thing() if self.rng.random() < 0.3 else self.worlds[self.rng.integers(len(self.worlds))]


def calls(arguments: Arguments, scene: breakshot.Scene, properties: breakshot.Properties):
    """One random call."""
    a = arguments
    simulator = breakshot.Simulator()
    texts = [scene.to_json(), properties.to_json()]

    def spoilt_text() -> str:
        text = texts[a.rng.integers(2)]
        at = int(a.rng.integers(len(text)))
        return text[:at] + a.choose(lambda: "", lambda: "9", lambda: "-", lambda: "}", lambda: "1e999") + text[at + 1 :]

    return a.choose(
        lambda: simulator.rollout(a.likely_world(), a.array(), seed=a.choose(lambda: 0, a.number)),
        lambda: simulator.rollout(a.likely_world(), a.thing(), threads=a.choose(lambda: 1, lambda: 2, a.thing)),
        lambda: simulator.rollout(a.worlds, a.array(), out=a.thing()),
        lambda: a.worlds[0].goal(a.thing()),
        lambda: a.worlds[0].goal(a.rng.normal(size=(2, 4, 3)), a.thing()),
        lambda: a.worlds[0].goal(np.full((2, 4, 3), a.number())),
        lambda: breakshot.Strike(a.thing(), a.number(), a.number(), a.number()),
        lambda: properties.sample(a.thing() if a.rng.random() < 0.9 else 3, a.choose(lambda: 1, a.thing)),
        lambda: breakshot.Scene.from_json(spoilt_text()),
        lambda: breakshot.Properties.from_json(spoilt_text()),
        lambda: scene.replace(goal={"min_distance_m": a.number()}),
        lambda: breakshot.World(a.thing(), a.thing(), speed_std=a.thing()),
        lambda: breakshot.simulate(scene, properties, a.thing()),
    )


def test_random_calls_raise_or_answer(pile):
    scene, properties = pile
    worlds = [breakshot.World(scene, properties), breakshot.World(scene, properties, uncertain=True)]
    arguments = Arguments(1, worlds)
    raised = 0
    for _ in range(CALLS):
        with np.errstate(all="ignore"):
            try:
                calls(arguments, scene, properties)
            except EXPECTED:
                raised += 1
    assert 0.2 * CALLS < raised < 0.98 * CALLS, f"{raised} of {CALLS} calls raised"
    with pytest.raises(breakshot.Error):
        breakshot.Simulator().rollout(worlds[0], [[math.nan] * 5])
