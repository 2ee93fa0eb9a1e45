"""Memory stays bounded over any number of rollouts."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import DEMO

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "ray_rollouts.py"
BLOCK = 50_000
ROLLOUTS = int(os.environ.get("BREAKSHOT_ROLLOUTS", "500000"))
MOST_GROWTH_MB = 20.0
"""Below the 40 MB that 400,000 rows of 100 bytes (three poses, flags, counts) would need, above what the allocator varies by."""


def peak_mb(strikes: int, properties: Path) -> float:
    """The most memory of a process that simulates so many strikes in blocks."""
    command = [sys.executable, str(EXAMPLE), str(DEMO / "pile.scene.toml"), str(properties), "--local"]
    process = subprocess.Popen(
        [*command, "--strikes", str(strikes), "--block", str(BLOCK)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return usage.ru_maxrss / 1024.0


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems count memory in other units")
def test_memory_does_not_grow_with_the_number_of_rollouts(demo_properties, tmp_path):
    properties = tmp_path / "properties.json"
    properties.write_text(demo_properties.to_json())
    few_mb, many_mb = peak_mb(2 * BLOCK, properties), peak_mb(ROLLOUTS, properties)
    print(f"{few_mb:.0f} MB for {2 * BLOCK} rollouts, {many_mb:.0f} MB for {ROLLOUTS}")
    assert many_mb < few_mb + MOST_GROWTH_MB
