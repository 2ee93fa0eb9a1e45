"""From strike videos to the one robot strike that singulates a pile.

The stages are functions, in the order in which data flows::

    import breakshot

    scene = breakshot.load_scene("pile.scene.toml")                 # what lies on the table
    properties = breakshot.estimate("campaign.toml")                # films -> friction, restitution, mass ratios
    plan = breakshot.plan(scene, properties)                        # the strike that singulates the pile
    trajectory = breakshot.simulate(scene, properties, plan)        # what it does, from impact to impact
    tracks = breakshot.track("film.mp4", scene.cell, breakshot.load_objects("objects.toml"), ["a", "c"], scene=scene)
    report = breakshot.verify(scene, properties, plan, tracks)      # the film of the strike beside its prediction
    command = breakshot.command(scene.cell, plan)                   # the joint path of the arm

Values have named fields, those of the files that the program reads and writes: ``plan.outcome``, ``properties.friction["a"].mean``.
They are printed, compared, copied, pickled, and converted with ``to_json`` and ``from_json``; ``replace`` gives a value with other
fields.  Where a function takes a value it also takes a mapping with its fields.

Many strikes are simulated at once, into NumPy arrays::

    world = breakshot.World(scene, properties, uncertain=True)      # every row is another scenario
    strikes = numpy.array([[-0.3, 0.0, 0.0, 0.5, 0.2]] * 1000)      # start x, start y (m), heading (rad), speed (m/s), travel (m)
    rollouts = breakshot.Simulator().rollout(world, strikes, seed=1)
    margin_m, singulated = world.goal(rollouts.poses, rollouts.fallen)

Units are SI and radians.  Positions are in the table frame: x to the right, y up in the camera's image, z out of the table.
Functions that take long let other Python threads run, use all cores, and end at Ctrl-C.  Wrong input raises `Error`, a `ValueError`
whose text names the file, object or argument, what was found and what is needed.

`breakshot.gym` has Gymnasium environments (``pip install breakshot[gym]``).
"""

from typing import Any as _Any

from ._breakshot import (
    Cell,
    Command,
    Error,
    Object,
    Plan,
    Properties,
    Refusal,
    Report,
    Scene,
    Strike,
    Survey,
    Tracks,
    Trajectory,
    World,
    __version__,
    command,
    estimate,
    load_cell,
    load_objects,
    load_properties,
    load_scene,
    load_strike,
    plan,
    simulate,
    survey,
    track,
    verify,
)
from ._record import Record

__all__ = [
    "Cell",
    "Command",
    "Error",
    "Object",
    "Plan",
    "Properties",
    "Record",
    "Refusal",
    "Report",
    "Rollouts",
    "Scene",
    "Simulator",
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
    "simulate",
    "survey",
    "track",
    "verify",
]

Record.__module__ = "breakshot"


def __getattr__(name: str) -> _Any:
    """Imports NumPy when rollouts are first asked for: `import breakshot` alone takes some milliseconds."""
    if name in ("Rollouts", "Simulator"):
        from . import _simulator

        globals().update(Rollouts=_simulator.Rollouts, Simulator=_simulator.Simulator)
        return globals()[name]
    raise AttributeError(f"module `breakshot` has no attribute `{name}`")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
