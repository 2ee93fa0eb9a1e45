# What the package re-exports is declared in `__init__.pyi`.
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from . import Cell as Cell
from . import Command as Command
from . import Error as Error
from . import Object as Object
from . import Plan as Plan
from . import Properties as Properties
from . import Refusal as Refusal
from . import Report as Report
from . import Scene as Scene
from . import Strike as Strike
from . import Survey as Survey
from . import Tracks as Tracks
from . import Trajectory as Trajectory
from . import World as World
from . import command as command
from . import estimate as estimate
from . import load_cell as load_cell
from . import load_objects as load_objects
from . import load_properties as load_properties
from . import load_scene as load_scene
from . import load_strike as load_strike
from . import plan as plan
from . import simulate as simulate
from . import survey as survey
from . import track as track
from . import verify as verify

__all__ = [
    "Cell",
    "Command",
    "Error",
    "MOST_ROWS",
    "Object",
    "Plan",
    "Properties",
    "Refusal",
    "Report",
    "Scene",
    "Strike",
    "Survey",
    "Tracks",
    "Trajectory",
    "World",
    "__version__",
    "command",
    "estimate",
    "load_cell",
    "load_objects",
    "load_properties",
    "load_scene",
    "load_strike",
    "plan",
    "rollout",
    "simulate",
    "survey",
    "track",
    "verify",
]
__version__: str
MOST_ROWS: Final[int]

def rollout(
    worlds: Sequence[World],
    world_of: npt.NDArray[np.int64],
    strikes: npt.NDArray[np.float64],
    shape: Sequence[int],
    outputs: tuple[npt.NDArray[Any], ...],
    seed: int,
    threads: int | None,
) -> None: ...
