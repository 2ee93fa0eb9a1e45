from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, NamedTuple, Self, TypeAlias, final, type_check_only

import numpy as np
import numpy.typing as npt

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

__version__: str

class Error(ValueError): ...

class Record(Mapping[str, Any]):
    def __init__(self, fields: Mapping[str, Any]) -> None: ...
    def __getattr__(self, name: str) -> Any: ...
    def __getitem__(self, key: str) -> Any: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def __dir__(self) -> list[str]: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[type[Record], tuple[dict[str, Any]]]: ...

# Parts of values: records at run time.

_Pose: TypeAlias = tuple[float, float, float]
_Point: TypeAlias = tuple[float, float]

@type_check_only
class _Estimate(Record):
    mean: float
    std: float | None
    standard_error: float
    interval_95: tuple[float, float]
    n: int

@type_check_only
class _Contacts(Record):
    objects: _Estimate | None
    striker: _Estimate | None

@type_check_only
class _SlipDamping(Record):
    probability: float
    exponent: _Estimate

@type_check_only
class _TangentialDamping(Record):
    objects: _SlipDamping | None
    striker: _SlipDamping | None

@type_check_only
class _Tilt(Record):
    x: _Estimate
    y: _Estimate
    covariance: float
    level: bool

@type_check_only
class _Covariance(Record):
    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

@type_check_only
class _Placed(Record):
    object: str
    position_m: _Point
    yaw_rad: float

@type_check_only
class _Goal(Record):
    min_distance_m: float
    mean_distance_m: tuple[float, float]
    min_gap_m: float
    inside_workspace: bool

@type_check_only
class _Prediction(Record):
    min_distance_m: float | None
    mean_distance_m: float | None
    success_probability: float | None

@type_check_only
class _Energy(Record):
    striker_work_j: float
    impact_loss_j: float
    friction_loss_j: float
    fallen_j: float

@type_check_only
class _Value:
    """What all values have in common."""
    def to_json(self) -> str: ...
    def replace(self, **fields: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object, /) -> Self: ...
    def __dir__(self) -> list[str]: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

# The fields of values, which are read from their JSON.

@type_check_only
class _CellFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def camera(self) -> Record: ...
    @property
    def tags(self) -> tuple[Record, ...]: ...
    @property
    def workspace(self) -> Record: ...
    @property
    def striker(self) -> Record: ...

@type_check_only
class _ObjectFields(_Value):
    @property
    def name(self) -> str: ...
    @property
    def shape(self) -> Record: ...
    @property
    def height_m(self) -> float: ...
    @property
    def marker(self) -> Record | None: ...

@type_check_only
class _SceneFields(_Value):
    @property
    def objects(self) -> tuple[Record, ...]: ...
    @property
    def observed_unix_s(self) -> float | None: ...
    @property
    def placed(self) -> tuple[_Placed, ...]: ...
    @property
    def walls(self) -> tuple[Record, ...]: ...
    @property
    def keep_out(self) -> tuple[Record, ...]: ...
    @property
    def goal(self) -> _Goal: ...

@type_check_only
class _StrikeFields(_Value):
    @property
    def start_m(self) -> _Point: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def speed_m_s(self) -> float: ...
    @property
    def travel_m(self) -> float: ...

@type_check_only
class _PropertiesFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def reference(self) -> str: ...
    @property
    def friction(self) -> Mapping[str, _Estimate]: ...
    @property
    def striker_restitution(self) -> Mapping[str, _Estimate]: ...
    @property
    def restitution(self) -> Mapping[str, _Estimate]: ...
    @property
    def mass_ratio(self) -> Mapping[str, _Estimate]: ...
    @property
    def pair_mass_ratio(self) -> Mapping[str, _Estimate]: ...
    @property
    def contact_friction(self) -> _Contacts: ...
    @property
    def tangential_restitution(self) -> _Contacts: ...
    @property
    def tangential_damping(self) -> _TangentialDamping: ...
    @property
    def support(self) -> Mapping[str, _Estimate]: ...
    @property
    def tilt(self) -> _Tilt | None: ...
    @property
    def covariance(self) -> _Covariance: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...

@type_check_only
class _TracksFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def video(self) -> str: ...
    @property
    def reprojection_rms_px(self) -> float: ...
    @property
    def tag_width_ratio(self) -> float: ...
    @property
    def camera_position_m(self) -> tuple[float, float, float]: ...
    @property
    def tracks(self) -> tuple[Record, ...]: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...

@type_check_only
class _TrajectoryFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def final(self) -> Mapping[str, _Pose]: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def events(self) -> tuple[Record, ...]: ...
    @property
    def energy(self) -> _Energy: ...
    @property
    def motions(self) -> Mapping[str, tuple[Record, ...]]: ...
    @property
    def closest_graze(self) -> Record | None: ...
    @property
    def notes(self) -> tuple[str, ...]: ...

@type_check_only
class _PlanFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def method(self) -> Literal["paper", "robust"]: ...
    @property
    def outcome(self) -> Literal["found", "best_effort", "unreachable"]: ...
    @property
    def reason(self) -> str: ...
    @property
    def prediction(self) -> _Prediction | None: ...
    @property
    def iterations(self) -> tuple[Record, ...]: ...
    @property
    def robustness(self) -> Record | None: ...

@type_check_only
class _SurveyFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def samples(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def strikes(self) -> tuple[Record, ...]: ...

@type_check_only
class _ReportFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def video(self) -> str: ...
    @property
    def before(self) -> Mapping[str, Record]: ...
    @property
    def observed(self) -> Mapping[str, Record]: ...
    @property
    def predicted(self) -> Mapping[str, _Pose]: ...
    @property
    def pairs(self) -> tuple[Record, ...]: ...
    @property
    def objects(self) -> tuple[Record, ...]: ...
    @property
    def summary(self) -> Record: ...
    @property
    def goal(self) -> Record: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...
    @property
    def alignment(self) -> Record | None: ...

@type_check_only
class _CommandFields(_Value):
    @property
    def version(self) -> int: ...
    @property
    def arm(self) -> str: ...
    @property
    def joints(self) -> tuple[str, ...]: ...
    @property
    def strike(self) -> Record: ...
    @property
    def stroke(self) -> Record: ...
    @property
    def phases(self) -> tuple[Record, ...]: ...
    @property
    def checks(self) -> tuple[Record, ...]: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...

@type_check_only
class _RefusalFields(_Value):
    @property
    def reason(self) -> str: ...
    @property
    def part(self) -> str | None: ...
    @property
    def fastest_m_s(self) -> float | None: ...

# The values.

@final
class Cell(_CellFields):
    @staticmethod
    def from_json(text: str) -> Cell: ...

@final
class Object(_ObjectFields):
    @staticmethod
    def from_json(text: str) -> Object: ...

@final
class Scene(_SceneFields):
    @staticmethod
    def from_json(text: str) -> Scene: ...
    @property
    def cell(self) -> Cell: ...
    def _repr_svg_(self) -> str: ...

@final
class Strike(_StrikeFields):
    def __new__(
        cls,
        start_m: Sequence[float],
        heading_rad: float,
        speed_m_s: float,
        travel_m: float,
        object: str | None = None,
    ) -> Self: ...
    @staticmethod
    def from_json(text: str) -> Strike: ...

@final
class Properties(_PropertiesFields):
    @staticmethod
    def from_json(text: str) -> Properties: ...
    def sample(self, n: int, seed: int = 0) -> list[Properties]: ...
    def _repr_html_(self) -> str | None: ...

@final
class Tracks(_TracksFields):
    @staticmethod
    def from_json(text: str) -> Tracks: ...
    def to_numpy(self) -> dict[str, npt.NDArray[np.void]]: ...
    def _repr_svg_(self) -> str | None: ...

@final
class Trajectory(_TrajectoryFields):
    @staticmethod
    def from_json(text: str) -> Trajectory: ...
    def pose(self, object: str, time_s: float) -> _Pose: ...

@final
class Plan(_PlanFields):
    @staticmethod
    def from_json(text: str) -> Plan: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def strike(self) -> Strike | None: ...
    def _repr_svg_(self) -> str: ...

@final
class Survey(_SurveyFields):
    @staticmethod
    def from_json(text: str) -> Survey: ...

@final
class Report(_ReportFields):
    @staticmethod
    def from_json(text: str) -> Report: ...

@final
class Command(_CommandFields):
    @staticmethod
    def from_json(text: str) -> Command: ...
    def short_hash(self) -> str: ...

@final
class Refusal(_RefusalFields):
    @staticmethod
    def from_json(text: str) -> Refusal: ...

# The stages.

_Path: TypeAlias = str | PathLike[str]
_Fields: TypeAlias = Mapping[str, Any]

def load_cell(path: _Path) -> Cell: ...
def load_objects(path: _Path) -> list[Object]: ...
def load_scene(path: _Path) -> Scene: ...
def load_properties(path: _Path) -> Properties: ...
def load_strike(path: _Path) -> Strike: ...
def track(
    film: _Path,
    cell: Cell | _Fields,
    objects: Sequence[Object | _Fields],
    names: Sequence[str],
    *,
    scene: Scene | _Fields | None = None,
    strike_heading_rad: float | None = None,
    frame_rate_hz: float | None = None,
) -> Tracks: ...
def estimate(campaign: _Path, *, reference: str | None = None, update: Properties | _Fields | None = None) -> Properties: ...
def simulate(scene: Scene | _Fields, properties: Properties | _Fields, strike: Strike | Plan | _Fields) -> Trajectory: ...
def plan(
    scene: Scene | _Fields,
    properties: Properties | _Fields,
    *,
    method: Literal["paper", "robust"] = "robust",
    seed: int = 1,
    any_arm: bool = False,
    remedies: bool = True,
    proposals: Sequence[_Fields] = ...,
    position_std_m: float | None = None,
    yaw_std_rad: float | None = None,
    speed_std: float | None = None,
    heading_std_rad: float | None = None,
) -> Plan: ...
def survey(
    scene: Scene | _Fields,
    properties: Properties | _Fields,
    *,
    strikes: int = 1000,
    samples: int = 100,
    seed: int = 1,
    any_arm: bool = False,
    position_std_m: float | None = None,
    yaw_std_rad: float | None = None,
    speed_std: float | None = None,
    heading_std_rad: float | None = None,
) -> Survey: ...
def verify(
    scene: Scene | _Fields,
    properties: Properties | _Fields,
    strike: Strike | Plan | _Fields,
    tracks: Tracks | _Fields,
) -> Report: ...
def command(cell: Cell | _Fields, strike: Strike | Plan | _Fields, scene: Scene | _Fields | None = None) -> Command | Refusal: ...

# Rollouts.

@final
class World:
    def __new__(
        cls,
        scene: Scene | _Fields,
        properties: Properties | _Fields,
        *,
        uncertain: bool = False,
        after_strike: Literal["retract", "lift"] = "retract",
        position_std_m: float | None = None,
        yaw_std_rad: float | None = None,
        speed_std: float | None = None,
        heading_std_rad: float | None = None,
    ) -> Self: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def properties(self) -> Properties: ...
    @property
    def uncertain(self) -> bool: ...
    def sample(self, n: int, seed: int = 0) -> list[World]: ...
    def goal(self, poses: npt.ArrayLike, fallen: npt.ArrayLike | None = None) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object, /) -> Self: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

class Rollouts(NamedTuple):
    poses: npt.NDArray[np.float64]
    fallen: npt.NDArray[np.bool_]
    impacts: npt.NDArray[np.int64]
    energy: npt.NDArray[np.float64]
    duration_s: npt.NDArray[np.float64]
    complete: npt.NDArray[np.bool_]

class Simulator:
    def rollout(
        self,
        worlds: World | Sequence[Any] | npt.NDArray[np.object_],
        strikes: npt.ArrayLike | Strike | Sequence[Strike],
        out: Rollouts | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> Rollouts: ...
