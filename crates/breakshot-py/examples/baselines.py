"""How often does one strike singulate a pile, and what does it cost to choose it?

    python baselines.py --train policy.npz       trains the policy through the environment (some minutes), stores and judges it
    python baselines.py --policy policy.npz      judges a stored policy and the others
    python baselines.py --proposals              trains proposals from surveys, and judges the search that begins with them
    python baselines.py                          judges the others: random strikes, the planners, cross-entropy search

All see the same piles of 2 to 6 objects of `breakshot/Singulate-v0`, which they strike once.  The environment draws friction, restitution,
masses, contacts, poses and the executed strike from the uncertainty of the learned properties.  Printed are success rates with 95 %
intervals (Wilson, 1927), the CPU time of a decision, and the success probability of the strikes as a plan states it: in fresh scenarios of
the learned properties.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

import breakshot
from breakshot.gym import SingulateEnv, SingulateVectorEnv

Array = npt.NDArray[np.float64]
Method = Callable[[SingulateEnv, np.random.Generator], Any]

OBJECTS = (2, 3, 4, 5, 6)
FIRST_SEED = 1_000_000
"""Of the piles that are judged, if not given; those of the training have smaller ones."""
ROUNDS, POPULATION, ELITE, SCENARIOS = 5, 64, 8, 16
"""Of the cross-entropy search: rounds, strikes a round, strikes that are kept, scenarios in which each is simulated."""
STEPS, PILES, HIDDEN, EPOCHS, BATCH, RATE = 16, 512, 64, 30, 256, 2e-3
"""Of the training: steps of the environment for each number of objects, piles a step, hidden units, passes over the strikes, their number
in a batch, step size of Adam."""
CANDIDATES = 512
"""Random strikes of which the policy takes the best."""
SURVEYED_PILES, SURVEYED_STRIKES, SURVEYED_SCENARIOS, SURVEY_EPOCHS = 160, 240, 8, 10
"""Of the training of proposals: piles for each number of objects, strikes of the planner's grid on each, scenarios, passes over all."""
PROPOSED, FIRST_ROUND, SECOND_ROUND, VARIED, VARIANTS = 2048, (128, 8), (24, 32), 5, 8
"""Of the search that begins with proposals: rated strikes; strikes and scenarios of two rounds; strikes that are varied, and how often."""
WIDTHS = (0.1, 0.06, 0.036, 0.02)
"""Standard deviations of the variations of an action, generation after generation."""
FRESH_SCENARIOS = 200
"""In which the success probability of a chosen strike is stated."""
MOST_CPU = 0.6
"""Part of the CPU time of the robust planner within which proposals have to reach its stated probability, to be worth keeping."""
SLACK_M = 0.02
"""A strike that misses the goal by so much counts as a success of 27 %, which shows the policy where successes are near."""


def random_strike(_: SingulateEnv, rng: np.random.Generator) -> Any:
    """Any action."""
    return rng.uniform(-1.0, 1.0, 4)


def planned(method: Literal["paper", "robust"]) -> Method:
    """A planner of the library; where it finds no strike, one that meets nothing."""

    def strike(env: SingulateEnv, rng: np.random.Generator) -> Any:
        plan = breakshot.plan(env.scene, env.properties, method=method, seed=int(rng.integers(2**31)), remedies=False)
        return plan.strike or breakshot.Strike([1e2, 1e2], 0.0, 0.5, 0.01)

    return strike


def cross_entropy(env: SingulateEnv, rng: np.random.Generator) -> Any:
    """The mean of a normal distribution of actions that narrows to the best of its draws (Rubinstein, 1999)."""
    worlds = breakshot.World(env.scene, env.properties, uncertain=True).sample(SCENARIOS, int(rng.integers(2**31)))
    # A heading has no end of its range: it is drawn around a random one.
    centre, spread = np.array([rng.uniform(-1.0, 1.0), 0.0, 0.0, 0.0]), np.array([1.0, 0.5, 0.6, 0.6])
    best, best_value = centre, -np.inf
    for _ in range(ROUNDS):
        actions = centre + spread * rng.normal(size=(POPULATION, 4))
        actions = np.column_stack([(actions[:, 0] + 1.0) % 2.0 - 1.0, np.clip(actions[:, 1:], -1.0, 1.0)])
        value = soft_success(margins_m(env, actions, worlds)).mean(axis=0)
        order = np.argsort(-value)[:ELITE]
        if value[order[0]] > best_value:
            best, best_value = actions[order[0]], value[order[0]]
        near = actions[order]
        near[:, 0] = best[0] + (near[:, 0] - best[0] + 1.0) % 2.0 - 1.0
        centre, spread = near.mean(axis=0), near.std(axis=0) + 0.02
    return best


def margins_m(env: SingulateEnv, actions: Iterable[Any], worlds: list[breakshot.World]) -> Array:
    """Margin of the goal by scenario and action, which may be a strike."""
    strikes = [env.strike(action) for action in actions]
    rollouts = breakshot.Simulator().rollout([[world] for world in worlds], strikes)
    return np.asarray(worlds[0].goal(rollouts.poses, rollouts.fallen)[0])


def best_first(env: SingulateEnv, actions: Array, worlds: list[breakshot.World]) -> Array:
    """The actions in the order of their smooth success in these scenarios."""
    return actions[np.argsort(-soft_success(margins_m(env, actions, worlds)).mean(axis=0), kind="stable")]


def proposed(policy: Policy) -> Method:
    """A search that begins with the strikes that a model rates best: two rounds of halving, then variations of the best ones."""

    def strike(env: SingulateEnv, rng: np.random.Generator) -> Any:
        actions = rng.uniform(-1.0, 1.0, (PROPOSED, 4))
        order = np.argsort(-policy.rate(features_of(*pile_of(env.scene), actions))[0])
        worlds = breakshot.World(env.scene, env.properties, uncertain=True).sample(SECOND_ROUND[1], int(rng.integers(2**31)))
        best = best_first(env, actions[order[: FIRST_ROUND[0]]], worlds[: FIRST_ROUND[1]])
        best = best_first(env, best[: SECOND_ROUND[0]], worlds)[:VARIED]
        for width in WIDTHS:
            varied = (best[:, None] + width * rng.normal(size=(len(best), VARIANTS, 4))).reshape(-1, 4)
            varied = np.column_stack([(varied[:, 0] + 1.0) % 2.0 - 1.0, np.clip(varied[:, 1:], -1.0, 1.0)])
            best = best_first(env, np.concatenate([best, varied]), worlds)[:VARIED]
        return best[0]

    return strike


def soft_success(margin_m: Array) -> Array:
    """Nearly 1 where the goal is fulfilled amply, 1/2 where just so, nearly 0 where it is missed by far."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(np.nan_to_num(margin_m, nan=-1.0), -0.5, 0.5) / SLACK_M)))


class Policy:
    """A network of two layers that rates strikes from the pile in the frame of the strike; the best-rated of random strikes is taken."""

    def __init__(self, weights: list[Array]) -> None:
        self.weights = weights

    @staticmethod
    def untrained(rng: np.random.Generator) -> Policy:
        """Random weights."""
        sizes = [4 * max(OBJECTS) + 2, HIDDEN, HIDDEN, 1]
        layers = [(rng.normal(size=(n, m)) * np.sqrt(2.0 / n), np.zeros(m)) for n, m in zip(sizes[:-1], sizes[1:], strict=True)]
        return Policy([array for layer in layers for array in layer])

    def rate(self, features: Array) -> tuple[Array, list[Array]]:
        """Probabilities of success, and the values of the layers."""
        layers = [features]
        for weight, bias in zip(self.weights[:-2:2], self.weights[1:-2:2], strict=True):
            layers.append(np.maximum(layers[-1] @ weight + bias, 0.0))
        logit = (layers[-1] @ self.weights[-2] + self.weights[-1])[:, 0]
        return np.asarray(1.0 / (1.0 + np.exp(-np.clip(logit, -30.0, 30.0)))), layers

    def gradient(self, features: Array, target: Array) -> list[Array]:
        """Of the cross entropy."""
        probability, layers = self.rate(features)
        back = ((probability - target) / len(target))[:, None]
        gradients: list[Array] = []
        for k in reversed(range(len(layers))):
            gradients = [layers[k].T @ back, back.sum(axis=0), *gradients]
            if k > 0:
                back = (back @ self.weights[2 * k].T) * (layers[k] > 0.0)
        return gradients

    def __call__(self, env: SingulateEnv, rng: np.random.Generator) -> Any:
        """The best-rated action."""
        poses, radii_m = pile_of(env.scene)
        actions = rng.uniform(-1.0, 1.0, (CANDIDATES, 4))
        return actions[np.argmax(self.rate(features_of(poses, radii_m, actions))[0])]


def pile_of(scene: breakshot.Scene) -> tuple[Array, Array]:
    """Positions (m) and radii (m) of the discs of the example."""
    radius_m = {kind.name: kind.shape["disc"]["radius_m"] for kind in scene.objects}
    return (
        np.array([placed.position_m for placed in scene.placed]),
        np.array([radius_m[placed.object.split("#")[0]] for placed in scene.placed]),
    )


def features_of(positions_m: Array, radii_m: Array, actions: Array) -> Array:
    """The pile as it lies along and across each strike, from the first object that is met on; speed and end of the strike."""
    centre = positions_m.mean(axis=0)
    reach_m = float((np.linalg.norm(positions_m - centre, axis=1) + radii_m).max())
    heading = np.pi * actions[:, :1]
    offset = (positions_m - centre)[None]
    along = offset[..., 0] * np.cos(heading) + offset[..., 1] * np.sin(heading)
    across = offset[..., 1] * np.cos(heading) - offset[..., 0] * np.sin(heading) - actions[:, 1:2] * reach_m
    order = np.argsort(along, axis=1)
    rows = np.stack([np.take_along_axis(values, order, axis=1) for values in (along, across)], axis=-1) / 0.05
    radii = (radii_m[order] / 0.05)[..., None]
    ends = ((actions[:, 3:4] * reach_m - np.take_along_axis(along, order, axis=1)) / 0.05)[..., None]
    known = np.concatenate([rows, radii, ends], axis=-1)
    padded = np.zeros((len(actions), max(OBJECTS), known.shape[-1]))
    padded[:, : known.shape[1]] = known
    return np.concatenate([padded.reshape(len(actions), -1), actions[:, 2:]], axis=1)


def trained(seed: int) -> Policy:
    """A policy from strikes in the environment: half of them random, half the best-rated of a few random ones."""
    rng = np.random.default_rng(seed)
    policy, features, targets = Policy.untrained(rng), [], []
    for half in range(2):
        for objects in OBJECTS:
            envs = SingulateVectorEnv(num_envs=PILES, objects=objects)
            envs.reset(seed=seed + 10_000 * (half + 2 * objects))
            for _ in range(STEPS // 2):
                piles = [pile_of(scene) for scene in envs.scenes]
                choices = rng.uniform(-1.0, 1.0, (PILES, 8 if half else 1, 4))
                rated = [features_of(*pile, actions) for pile, actions in zip(piles, choices, strict=True)]
                best = [int(np.argmax(policy.rate(rows)[0])) for rows in rated]
                actions = np.array([choice[k] for choice, k in zip(choices, best, strict=True)])
                *_, infos = envs.step(actions)
                features.append(np.array([rows[k] for rows, k in zip(rated, best, strict=True)]))
                targets.append(soft_success(infos["margin_m"]))
        fit(policy, np.concatenate(features), np.concatenate(targets), rng)
    return policy


def surveyed(seed: int) -> tuple[Policy, int]:
    """A model that rates strikes as surveys of random piles do, and the number of surveyed strikes."""
    rng = np.random.default_rng(seed)
    policy, features, targets = Policy.untrained(rng), [], []
    for objects in OBJECTS:
        env = SingulateEnv(objects=objects)
        for pile in range(SURVEYED_PILES):
            env.reset(seed=seed + 10_000 * objects + pile)
            survey = breakshot.survey(
                env.scene, env.properties, strikes=SURVEYED_STRIKES, samples=SURVEYED_SCENARIOS, seed=int(rng.integers(2**31))
            )
            if survey.strikes:
                features.append(features_of(*pile_of(env.scene), actions_of(env.scene, [row.strike for row in survey.strikes])))
                targets.append(np.array([row.success_probability for row in survey.strikes]))
    fit(policy, np.concatenate(features), np.concatenate(targets), rng, SURVEY_EPOCHS)
    return policy, sum(map(len, targets))


def actions_of(scene: breakshot.Scene, strikes: list[Any]) -> Array:
    """The actions of strikes on a pile: the inverse of `SingulateEnv.strike`, also for strikes that end outside an action's range."""
    positions_m, radii_m = pile_of(scene)
    centre_m = positions_m.mean(axis=0)
    reach_m = float((np.linalg.norm(positions_m - centre_m, axis=1) + radii_m).max())
    slowest_m_s, fastest_m_s = scene.cell.striker["speed_range_m_s"]
    heading_rad = np.array([strike.heading_rad for strike in strikes])
    x_m, y_m = (np.array([strike.start_m for strike in strikes]) - centre_m).T
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    ends_m = x_m * cos + y_m * sin + [strike.travel_m for strike in strikes]
    paces = (np.array([strike.speed_m_s for strike in strikes]) - slowest_m_s) / (fastest_m_s - slowest_m_s)
    return np.column_stack([heading_rad / np.pi, (y_m * cos - x_m * sin) / reach_m, 2.0 * paces - 1.0, ends_m / reach_m])


def fit(policy: Policy, features: Array, targets: Array, rng: np.random.Generator, epochs: int = EPOCHS) -> None:
    """Adam (Kingma and Ba, 2015)."""
    first, second, count = [0.0 * w for w in policy.weights], [0.0 * w for w in policy.weights], 0
    for epoch in range(epochs):
        order = rng.permutation(len(targets))
        for batch in np.array_split(order, max(1, len(order) // BATCH)):
            count += 1
            rate = RATE * (1.0 - epoch / epochs) * np.sqrt(1.0 - 0.999**count) / (1.0 - 0.9**count)
            for k, gradient in enumerate(policy.gradient(features[batch], targets[batch])):
                first[k] = 0.9 * first[k] + 0.1 * gradient
                second[k] = 0.999 * second[k] + 0.001 * gradient**2
                policy.weights[k] -= rate * first[k] / (np.sqrt(second[k]) + 1e-8)


def wilson(successes: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a rate (Wilson, "Probable inference", 1927)."""
    z = 1.96
    rate = successes / count
    middle = (rate + z * z / (2 * count)) / (1.0 + z * z / count)
    half = z / (1.0 + z * z / count) * np.sqrt(rate * (1.0 - rate) / count + z * z / (4.0 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


class Judgement(NamedTuple):
    """Of one method on the piles of one number of objects."""

    successes: int
    cpu_s: float
    """Of all decisions."""
    stated: float
    """Sum of the success probabilities in fresh scenarios."""


def judged(method: Method, objects: int, piles: int, first_seed: int) -> Judgement:
    """Decides and strikes."""
    env, successes, cpu_s, stated = SingulateEnv(objects=objects), 0, 0.0, 0.0
    for pile in range(piles):
        env.reset(seed=first_seed + pile)
        start_s = time.process_time()
        action = method(env, np.random.default_rng([pile, objects]))
        cpu_s += time.process_time() - start_s
        worlds = breakshot.World(env.scene, env.properties, uncertain=True).sample(FRESH_SCENARIOS, pile)
        stated += float((margins_m(env, [action], worlds) >= 0.0).mean())
        *_, info = env.step(action)
        successes += bool(info["success"])
    return Judgement(successes, cpu_s, stated)


def row(name: str, rows: list[Judgement], piles: int) -> str:
    """Of the table."""
    count = piles * len(OBJECTS)
    cells = []
    for judgement in rows:
        low, high = wilson(judgement.successes, piles)
        cells.append(f"{100 * judgement.successes / piles:.0f} % ({100 * low:.0f} to {100 * high:.0f})")
    total = sum(judgement.successes for judgement in rows)
    low, high = wilson(total, count)
    stated = sum(judgement.stated for judgement in rows) / count
    cost_ms = 1e3 * sum(judgement.cpu_s for judgement in rows) / count
    overall = f"{100 * total / count:.0f} % ({100 * low:.0f} to {100 * high:.0f})"
    return f"| {name} | {' | '.join(cells)} | {overall} | {100 * stated:.1f} % | {cost_ms:.0f} ms |"


def verdict(proposals: list[Judgement], robust: list[Judgement]) -> str:
    """Whether proposals are worth keeping."""
    stated, needed = (sum(judgement.stated for judgement in rows) for rows in (proposals, robust))
    cost = sum(judgement.cpu_s for judgement in proposals) / sum(judgement.cpu_s for judgement in robust)
    return (
        f"proposals: {stated / needed:.3f} of the robust planner's stated probability (needed: 1) at {100 * cost:.0f} % of its CPU time "
        f"(needed: at most {100 * MOST_CPU:.0f} %): the criterion is {'met' if stated >= needed and cost <= MOST_CPU else 'missed'}"
    )


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--train", type=Path, metavar="FILE", help="train a policy and store it here")
    parser.add_argument("--policy", type=Path, metavar="FILE", help="a stored policy")
    parser.add_argument("--proposals", action="store_true", help="train proposals from surveys")
    parser.add_argument("--piles", type=int, default=40, help="piles for each number of objects (40)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help=f"of the piles that are judged ({FIRST_SEED})")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    methods: dict[str, Method] = {"random": random_strike, "paper": planned("paper"), "robust": planned("robust")}
    methods["cross-entropy search"] = cross_entropy
    if arguments.train:
        start_s = time.process_time()
        policy = trained(seed=1)
        np.savez(arguments.train, *policy.weights)
        print(f"training: {2 * (STEPS // 2) * PILES * len(OBJECTS)} strikes, {time.process_time() - start_s:.0f} s of CPU time\n")
        methods["learned policy"] = policy
    elif arguments.policy:
        with np.load(arguments.policy) as stored:
            methods["learned policy"] = Policy([stored[name] for name in stored.files])
    if arguments.proposals:
        start_s = time.process_time()
        policy, count = surveyed(seed=2)
        print(f"proposals: {count} surveyed strikes, {time.process_time() - start_s:.0f} s of CPU time\n")
        methods["learned proposals"] = proposed(policy)
    heads = [f"{n} objects" for n in OBJECTS]
    print(f"| method | {' | '.join(heads)} | all | stated | CPU time of a decision |\n|---|{'---|' * len(OBJECTS)}---|---|---|", flush=True)
    found = {}
    for name, method in methods.items():
        found[name] = [judged(method, objects, arguments.piles, arguments.first_seed) for objects in OBJECTS]
        print(row(name, found[name], arguments.piles), flush=True)
    if arguments.proposals:
        print(f"\n{verdict(found['learned proposals'], found['robust'])}")


if __name__ == "__main__":
    main()
