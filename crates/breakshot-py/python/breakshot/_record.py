"""Fields of values: what JSON objects become in Python."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

_LONGEST_TEXT = 60


class Record(Mapping[str, Any]):
    """The named fields of a part of a value: ``record.mean`` is ``record["mean"]``.

    A record is a mapping that cannot be changed; lists in it are tuples.
    """

    __slots__ = ("_fields",)
    _fields: dict[str, Any]

    def __init__(self, fields: Mapping[str, Any]) -> None:
        object.__setattr__(self, "_fields", {key: _frozen(value) for key, value in fields.items()})

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and name in self._fields:
            return self._fields[name]
        raise AttributeError(f"no field `{name}`; there are {', '.join(self._fields) or 'none'}")

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"`{name}` cannot be set; `replace` of the whole value gives another value")

    def __getitem__(self, key: str) -> Any:
        return self._fields[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(key for key in self._fields if key.isidentifier())]

    def __repr__(self) -> str:
        return self._shown_as("Record")

    def __hash__(self) -> int:
        return hash(tuple(self._fields.items()))

    def __reduce__(self) -> tuple[type[Record], tuple[dict[str, Any]]]:
        return Record, (self._fields,)

    def _shown_as(self, name: str) -> str:
        return f"{name}({', '.join(f'{key}={_shortened(value)}' for key, value in self._fields.items())})"


def record_of(text: str) -> Any:
    """The record of JSON text."""
    return _frozen(json.loads(text, object_hook=Record))


def text_of(value: object) -> str:
    """JSON text of nested mappings, sequences, arrays and values of this package."""
    return json.dumps(value, default=_plain, allow_nan=False)


def replaced(text: str, fields: Mapping[str, Any] | None) -> str:
    """JSON text with some of its fields replaced."""
    return text_of({**json.loads(text), **(fields or {})})


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, (list, tuple)) else value


def _shortened(value: object) -> str:
    if isinstance(value, tuple) and len(value) > 3:
        return f"<{len(value)} items>"
    text = repr(value)
    return text if len(text) <= _LONGEST_TEXT else f"<{type(value).__name__} of {_size(value)}>"


def _size(value: object) -> str:
    fields = value if isinstance(value, Mapping) else None
    return f"{len(fields)} fields" if fields is not None else "many items"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return value.tolist()
    if hasattr(value, "to_json"):
        return json.loads(value.to_json())
    raise TypeError(f"{type(value).__name__} cannot be a field of a value")
