"""Rate-independent hysteresis as a library of its own: operators, inverses, maps, registry.

Every operator is a frozen value with ``initial_state``, ``simulate`` (one history), ``step`` (rows
of a batch) and ``scaled``; its state is passed in and returned. Importing the package imports each
of its modules, and a module registers the model that it holds
(:mod:`~pam_envs.hysteresis.protocol`).
"""

from importlib import import_module as _import_module
from pkgutil import iter_modules as _iter_modules

for _module in _iter_modules(__path__):
    _import_module(f"{__name__}.{_module.name}")
