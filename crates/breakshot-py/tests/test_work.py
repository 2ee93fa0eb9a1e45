"""Long work: other threads, Ctrl-C, forks."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import DEMO, discs

import breakshot

STRIKE = [-0.3, 0.0, 0.0, 0.6, 0.3]
LONGEST_STOP_S = 0.3
MOST_WAIT_S = 3.0
"""Of the clock, also where other processes take most of the cores."""


def seconds_to_stop(work) -> float:
    """Seconds from Ctrl-C to the end of the work, which would take longer than the test waits.

    Of the clock, or of this process's CPU time if that is less: the time that other processes take is not the package's.
    """
    pressed = []

    def press() -> None:
        pressed.append((time.monotonic(), time.process_time()))
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.4, press)
    # A shell starts a command in the background with this signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
            time.sleep(1.0)
        (clock_s, cpu_s), = pressed
        waited_s, worked_s = time.monotonic() - clock_s, time.process_time() - cpu_s
        print(f"stopped after {waited_s:.3f} s, {worked_s:.3f} s of CPU time")
        assert waited_s < MOST_WAIT_S
        return min(waited_s, worked_s)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("threads", [1, 2, None])
def test_ctrl_c_ends_rollouts(uncertain_world, threads):
    many = np.broadcast_to(STRIKE, (3_000_000, 5))
    took_s = seconds_to_stop(lambda: breakshot.Simulator().rollout(uncertain_world, many, threads=threads))
    assert took_s < LONGEST_STOP_S
    after = breakshot.Simulator().rollout(uncertain_world, many[:8], threads=threads)
    assert after.complete.all()


def test_ctrl_c_ends_surveys_and_estimates(pile):
    took_s = seconds_to_stop(lambda: breakshot.survey(*pile, strikes=10_000, samples=1000))
    assert took_s < LONGEST_STOP_S
    took_s = seconds_to_stop(lambda: breakshot.estimate(DEMO / "campaign.toml"))
    assert took_s < LONGEST_STOP_S
    assert breakshot.survey(*pile, strikes=3, samples=3).samples == 3


def test_ctrl_c_ends_plans():
    grid = [(0.08 * (k % 3), 0.08 * (k // 3)) for k in range(8)]
    scene, properties = discs([0.035] * 8, grid)
    assert seconds_to_stop(lambda: [breakshot.plan(scene, properties, seed=k) for k in range(1000)]) < LONGEST_STOP_S


def test_other_python_threads_run_meanwhile(uncertain_world):
    ticks, is_over = [], threading.Event()

    def tick() -> None:
        while not is_over.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    start = time.monotonic()
    breakshot.Simulator().rollout(uncertain_world, np.broadcast_to(STRIKE, (20_000, 5)), threads=1)
    end = time.monotonic()
    is_over.set()
    ticker.join()
    assert sum(start < tick < end for tick in ticks) > 20 * (end - start)


def answer_of_child(work, seconds: float = 30.0) -> bytes:
    """What the work returns in a forked child; fails if the child does not end in time."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(writer, work())
        finally:
            os._exit(0)
    os.close(writer)
    deadline = time.monotonic() + seconds
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            pytest.fail(f"the child did not end within {seconds} s")
        time.sleep(0.01)
    with os.fdopen(reader, "rb") as pipe:
        return pipe.read()


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_child_gives_the_same_numbers(pile, uncertain_world):
    many = np.broadcast_to(STRIKE, (400, 5))

    def work() -> bytes:
        rollouts = breakshot.Simulator().rollout(uncertain_world, many, seed=3)
        return rollouts.poses.tobytes()[:4096] + breakshot.plan(*pile).to_json()[:4096].encode()

    expected = work()
    assert answer_of_child(work) == expected
    is_over = threading.Event()

    def keep_busy() -> None:
        while not is_over.is_set():
            breakshot.Simulator().rollout(uncertain_world, np.broadcast_to(STRIKE, (2000, 5)), threads=2)

    busy = threading.Thread(target=keep_busy)
    busy.start()
    try:
        for _ in range(5):
            assert answer_of_child(work) == expected
    finally:
        is_over.set()
        busy.join()
    assert work() == expected
