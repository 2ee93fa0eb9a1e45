"""Values: fields, text, copies, pickles."""

from __future__ import annotations

import copy
import inspect
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import DEMO

import breakshot

ARM = "offset_wrist.urdf"
STUB = Path(breakshot.__file__).with_name("__init__.pyi").read_text()


@pytest.fixture(scope="module")
def values(demo_scene, demo_properties) -> list:
    """A value of each class."""
    strike = breakshot.load_strike(DEMO / "pile.strike.json")
    objects = breakshot.load_objects(DEMO / "objects.toml")
    robot = {"arm": "indy7", "base_from_table": {"position_m": [0.5, 0.0, 0.0], "rpy_rad": [0.0, 0.0, 1.5708]}}
    cell = demo_scene.cell.replace(robot={**robot, "tool_offset_m": [0.0, 0.0, 0.15]})
    command = next(
        answer
        for y_m in (0.0, 0.1, -0.1)
        for x_m in (-0.1, 0.0, 0.1)
        if isinstance(answer := breakshot.command(cell, breakshot.Strike([x_m, y_m], 0.0, 0.3, 0.08)), breakshot.Command)
    )
    tracks = breakshot.track(DEMO / "pile.mp4", demo_scene.cell, objects, ["a", "c", "e"], scene=demo_scene)
    return [
        demo_scene.cell,
        objects[0],
        demo_scene,
        strike,
        demo_properties,
        tracks,
        breakshot.simulate(demo_scene, demo_properties, strike),
        breakshot.plan(demo_scene, demo_properties),
        breakshot.survey(demo_scene, demo_properties, strikes=5, samples=5),
        breakshot.verify(demo_scene, demo_properties, strike, tracks),
        command,
        breakshot.command(cell, breakshot.Strike([5.0, 5.0], 0.0, 0.3, 0.08)),
    ]


def test_there_is_a_value_of_each_class(values):
    classes = {kind for kind in vars(breakshot).values() if inspect.isclass(kind) and hasattr(kind, "from_json")}
    assert {type(value) for value in values} == classes


def test_values_survive_copies_pickles_and_json(values):
    for value in values:
        for other in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert other == value and type(other) is type(value)
        assert type(value).from_json(value.to_json()).to_json() == value.to_json()
        assert value != object() and value.replace() == value


def test_the_stub_declares_the_fields_of_each_value(values):
    for value in values:
        name = type(value).__name__
        body = STUB.split(f"class _{name}Fields(_Value):\n")[1].split("\n\n")[0]
        declared = set(re.findall(r"def (\w+)\(self\)", body))
        fields = {field for field in dir(value) if not field.startswith("_") and not hasattr(type(value), field)}
        optional = {"causes", "assumed", "evidence", "scale_px_per_m", "table", "robot", "points", "arm", "object", "mass_kg", "urdf"}
        # What a file leaves out where there is none.
        assert declared - fields <= {"marker", "support", "tangential_damping", "tangential_restitution", "tag_width_ratio", "camera_position_m", "tilt"}, f"{name} has no {declared - fields}"
        assert fields - declared <= optional | {"striker", "scene"} | set(dir(breakshot.Record)), f"{name}: {fields - declared}"


def test_a_value_shows_its_fields(values):
    for value in values:
        assert repr(value).startswith(f"{type(value).__name__}(") and len(repr(value)) < 2000


def test_replace_gives_another_value(demo_scene):
    moved = [{**placed, "yaw_rad": 0.5} for placed in demo_scene.placed]
    other = demo_scene.replace(placed=moved)
    assert other.placed[1].yaw_rad == 0.5 and demo_scene.placed[1].yaw_rad != 0.5
    assert other != demo_scene
    with pytest.raises(breakshot.Error, match="`gaol`; needed: one of cell, objects"):
        demo_scene.replace(gaol={})
    with pytest.raises(AttributeError, match="`replace`"):
        demo_scene.placed[0].yaw_rad = 1.0
    with pytest.raises(AttributeError, match="no field `position`"):
        _ = demo_scene.placed[0].position


def test_values_are_checked(demo_scene):
    with pytest.raises(breakshot.Error, match=re.escape("Strike: speed_m_s is -1; needed: a positive number")):
        breakshot.Strike([0.0, 0.0], 0.0, -1.0, 0.1)
    with pytest.raises(breakshot.Error, match="no object|`z`"):
        demo_scene.replace(placed=[{"object": "z", "position_m": [0, 0]}])
    with pytest.raises(TypeError, match="int given; needed: Scene"):
        breakshot.simulate(3, 3, 3)
    assert issubclass(breakshot.Error, ValueError)


def test_tracks_are_arrays(values):
    tracks = next(value for value in values if isinstance(value, breakshot.Tracks))
    arrays = tracks.to_numpy()
    assert list(arrays) == ["a", "c", "e"]
    samples = tracks.tracks[0].samples
    assert arrays["a"].shape == (len(samples),)
    np.testing.assert_array_equal(arrays["a"]["x_m"], [sample.x_m for sample in samples])
    yaws = [np.nan if sample.yaw_rad is None else sample.yaw_rad for sample in samples]
    np.testing.assert_array_equal(arrays["a"]["yaw_rad"], yaws)


def test_samples_of_properties_spread_as_their_errors(pile):
    drawn = pile[1].sample(1000, seed=3)
    frictions = np.array([properties.friction["a"].mean for properties in drawn])
    assert abs(frictions.mean() - 0.25) < 0.0015 and abs(frictions.std() - 0.01) < 0.001
    assert pile[1].sample(3, seed=3) == drawn[:3] and pile[1].sample(3, seed=4) != drawn[:3]


def test_help_is_a_tour():
    assert len(breakshot.__doc__.splitlines()) > 20
    for name in breakshot.__all__:
        assert name == "__version__" or inspect.getdoc(getattr(breakshot, name)), name


def test_the_arm_of_a_pickled_cell_is_read_again(demo_scene):
    urdf = DEMO.parents[1] / "crates/breakshot/tests/data/arms" / ARM
    base = {"position_m": [0.5, 0.0, 0.0], "rpy_rad": [0.0, 0.0, 1.5708]}
    cell = demo_scene.cell.replace(robot={"arm": str(urdf), "base_from_table": base})
    assert pickle.loads(pickle.dumps(cell)) == cell
    with pytest.raises(breakshot.Error, match="nowhere.urdf: cannot be read"):
        demo_scene.cell.replace(robot={"arm": "nowhere.urdf", "base_from_table": base})
