"""Many strikes on many worlds, into NumPy arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _breakshot

_STRIKE_FIELDS = ("heading_rad", "speed_m_s", "travel_m")


class Rollouts(NamedTuple):
    """The outcomes of strikes, one row each, with the shape of the broadcast worlds and strikes.

    A strike that starts inside an object is not simulated: its poses, energy and duration are NaN and `complete` is false.
    """

    poses: npt.NDArray[np.float64]
    """Final x (m), y (m) and yaw (rad) of each object in the table frame, in the order of ``World.names``: ``(..., objects, 3)``.
    Where the worlds differ in their number of objects the last ones of the smaller worlds are NaN."""
    fallen: npt.NDArray[np.bool_]
    """Whether each object fell off the table: ``(..., objects)``.  Its pose is then the one at the edge."""
    impacts: npt.NDArray[np.int64]
    """Number of impacts: ``(...)``."""
    energy: npt.NDArray[np.float64]
    """Work of the striker on the objects (J, or per mass of the reference object if no object was weighed): ``(...)``."""
    duration_s: npt.NDArray[np.float64]
    """Time at which everything is at rest (s after the striker starts): ``(...)``."""
    complete: npt.NDArray[np.bool_]
    """Whether everything came to rest within the bounds of a simulation: ``(...)``."""


class Simulator:
    """Simulates strikes in parallel, without Python's lock."""

    def rollout(
        self,
        worlds: Any,
        strikes: Any,
        out: Rollouts | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> Rollouts:
        """The outcomes of strikes on worlds, broadcast against each other as NumPy does.

        Args:
            worlds: A `World`, or an array or nested sequence of them.
            strikes: An array of shape ``(..., 5)`` with start x (m), start y (m), heading (rad), speed (m/s) and travel (m) in the
                table frame; or a `Strike`, or a sequence of them.  The first axes are broadcast against the worlds:
                ``rollout(worlds, strikes[:, None])`` simulates every strike in every world.
            out: The result of an earlier rollout of the same shape, whose arrays are filled and returned.
            seed: Seed of the draws in uncertain worlds.  Row ``k``, counted in C order, depends on ``(seed, k)`` alone.
            threads: Number of threads; by default one for each core.  The result is the same to the bit for any number.

        Raises:
            Error: A strike that no striker can carry out, arrays of a wrong shape or kind.
        """
        distinct, world_of = _distinct(worlds)
        numbers, strike_shape = _strike_numbers(strikes)
        shape = _row_shape(world_of.shape, strike_shape)
        rollouts = _outputs(shape, max(len(world.names) for world in distinct), out)
        seed, threads = int(seed), None if threads is None else int(threads)
        if not 0 <= seed < 2**64:
            raise _breakshot.Error(f"rollout: seed is {seed}; needed: from 0 to 2^64 - 1")
        flat = tuple(array.reshape(-1) for array in rollouts)
        _breakshot.rollout(distinct, world_of, numbers, list(shape), flat, seed, threads)
        return rollouts


def _distinct(worlds: Any) -> tuple[list[Any], npt.NDArray[np.int64]]:
    """The worlds, each once, and the index of each in the shape in which they are given."""
    array = np.empty((), dtype=object)
    if isinstance(worlds, _breakshot.World):
        array[()] = worlds
    else:
        array = np.asarray(worlds, dtype=object)
    if array.size == 0 or not all(isinstance(world, _breakshot.World) for world in array.flat):
        kinds = sorted({type(world).__name__ for world in array.flat})
        raise _breakshot.Error(f"rollout: worlds is {', '.join(kinds) or 'empty'}; needed: a World, or an array of them")
    index = {id(world): k for k, world in reversed(list(enumerate(array.flat)))}
    first = sorted(set(index.values()))
    rank = {k: number for number, k in enumerate(first)}
    world_of = np.array([rank[index[id(world)]] for world in array.flat], dtype=np.int64)
    return [array.flat[k] for k in first], world_of.reshape(array.shape)


def _strike_numbers(strikes: Any) -> tuple[npt.NDArray[np.float64], tuple[int, ...]]:
    """The five numbers of each strike on the last axis, and the shape of the strikes.

    An axis along which one strike is repeated without a copy has one entry.
    """
    if isinstance(strikes, _breakshot.Strike):
        return np.array(_numbers(strikes)), ()
    if isinstance(strikes, (list, tuple)) and any(isinstance(strike, _breakshot.Strike) for strike in strikes):
        strikes = [_numbers(strike) if isinstance(strike, _breakshot.Strike) else strike for strike in strikes]
    try:
        array = np.asarray(strikes)
    except (TypeError, ValueError) as error:
        raise _breakshot.Error(f"rollout: strikes is no array of numbers ({error}); needed: an array (..., 5)") from None
    if array.ndim == 0 or array.shape[-1] != 5:
        raise _breakshot.Error(
            f"rollout: the shape of strikes is {array.shape}; needed: (..., 5): start x (m), start y (m), heading (rad), "
            "speed (m/s), travel (m)"
        )
    shape = array.shape[:-1]
    _check_size(shape)
    once = array[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in array.strides[:-1])]
    try:
        return np.require(once, np.float64, ["A", "C"]), shape
    except (TypeError, ValueError) as error:
        raise _breakshot.Error(f"rollout: strikes is no array of numbers ({error}); needed: an array (..., 5)") from None


def _check_size(shape: tuple[int, ...]) -> None:
    if np.prod(shape, dtype=float) > _breakshot.MOST_ROWS:
        raise _breakshot.Error(f"rollout: the shape is {shape}; needed: at most {_breakshot.MOST_ROWS} rows in one call")


def _numbers(strike: Any) -> list[float]:
    return [*strike.start_m, *(getattr(strike, field) for field in _STRIKE_FIELDS)]


def _row_shape(worlds: tuple[int, ...], strikes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        shape = np.broadcast_shapes(worlds, strikes)
    except ValueError:
        raise _breakshot.Error(
            f"rollout: the shape of worlds is {worlds} and that of strikes {strikes}; needed: shapes that can be "
            "broadcast, such as (w,) and (n, 1) for strikes of shape (n, 1, 5)"
        ) from None
    _check_size(shape)
    return shape


def _outputs(shape: tuple[int, ...], objects: int, out: Rollouts | None) -> Rollouts:
    kinds = {
        "poses": ((*shape, objects, 3), np.float64),
        "fallen": ((*shape, objects), np.bool_),
        "impacts": (shape, np.int64),
        "energy": (shape, np.float64),
        "duration_s": (shape, np.float64),
        "complete": (shape, np.bool_),
    }
    if out is None:
        return Rollouts(*(np.empty(size, dtype=kind) for size, kind in kinds.values()))
    if not isinstance(out, Rollouts):
        raise _breakshot.Error(f"rollout: out is {type(out).__name__}; needed: Rollouts of an earlier call")
    for array, (name, (size, kind)) in zip(out, kinds.items(), strict=True):
        is_right = isinstance(array, np.ndarray) and array.shape == size and array.dtype == kind
        if not (is_right and array.flags.c_contiguous and array.flags.writeable and array.flags.aligned):
            found = f"{array.dtype} of shape {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
            raise _breakshot.Error(
                f"rollout: out.{name} is {found}; needed: a writable, contiguous array of {np.dtype(kind)} of shape {size}"
            )
    return out


Rollouts.__module__ = Simulator.__module__ = "breakshot"
