"""Memory stays bounded over any number of rollouts."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
BLOCK = 50_000
ROLLOUTS = int(os.environ.get("BREAKSHOT_ROLLOUTS", "500000"))
MOST_GROWTH_MB = 20.0
"""Below the 40 MB that 400,000 rows of 100 bytes (four poses, flags, counts) would need, above what the allocator varies by."""
PROGRAM = """
import sys

import breakshot
import numpy as np
import rollouts

[world], strikes = rollouts.piles(rollouts.PILE)
numbers, kept = np.tile(strikes, (int(sys.argv[2]), 1)), None
for seed in range(int(sys.argv[1])):
    numbers[:, 1] += 1e-12
    kept = breakshot.Simulator().rollout(world, numbers, out=kept, seed=seed)
"""
"""Simulates block after block into the same arrays, as the example for many machines does."""


def peak_mb(blocks: int) -> float:
    """The most memory of a process that simulates so many blocks."""
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(blocks), str(BLOCK)], cwd=EXAMPLES)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return usage.ru_maxrss / 1024.0


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems count memory in other units")
def test_memory_does_not_grow_with_the_number_of_rollouts():
    few_mb, many_mb = peak_mb(2), peak_mb(ROLLOUTS // BLOCK)
    print(f"{few_mb:.0f} MB for {2 * BLOCK} rollouts, {many_mb:.0f} MB for {ROLLOUTS}")
    assert many_mb < few_mb + MOST_GROWTH_MB
