"""The ``info`` of a step: a dict that is filled when it is first read.

Filling it takes longer than simulating the plant, and most steps of a learning run never read it.
"""

from collections.abc import Callable
from typing import Any


def _filling(name: str) -> Callable[..., Any]:
    """Return the dict's method of that name, which fills the dict first."""
    method = getattr(dict, name)

    def touched(self: Info, *arguments: Any, **named: Any) -> Any:
        if self._numbers is not None:
            self._fill()
        for other in arguments:
            if isinstance(other, Info) and other._numbers is not None:
                other._fill()
        return method(self, *arguments, **named)

    touched.__name__ = name
    touched.__doc__ = method.__doc__
    return touched


class Info(dict[str, Any]):
    """A dict of ``keys`` and ``numbers``, one double each, that is filled on first access.

    The ``first`` value is in the dict from the start: C code that asks a dict for its size before
    it asks for its items would otherwise take it for empty.
    """

    __slots__ = ("_names", "_numbers")

    def __init__(self, keys: tuple[str, ...], first: float, numbers: bytes) -> None:
        dict.__setitem__(self, keys[0], first)
        self._names = keys
        self._numbers: Any = numbers

    def _fill(self) -> None:
        values, self._numbers = memoryview(self._numbers).cast("d").tolist(), None
        dict.update(self, zip(self._names, values, strict=True))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy as an ordinary dict."""
        return dict, (dict(self.items()),)


_TOUCHING = """
    __contains__ __delitem__ __eq__ __getitem__ __ior__ __iter__ __len__ __ne__ __or__ __repr__
    __reversed__ __ror__ __setitem__ clear copy get items keys pop popitem setdefault update values
"""
for _name in _TOUCHING.split():
    setattr(Info, _name, _filling(_name))
