"""Row numbers of a plant's state and parameters, from one declaration of their names.

A plant's numbers are rows of two matrices whose columns are environments (lanes): ``rows`` is the
state, followed by that of the hysteresis and that of the effects, and ``fixed`` the parameters,
which all tiles of a batch share unless they are drawn. The module ``rows`` of a plant holds a
constant for each row, its name in capitals: ``PRESSURE`` of the state ``"pressure"``,
``MUSCLE_AREA`` of the parameter ``"muscle.area"``.
"""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.mechanics.guide import GUIDE
from pam_envs.muscle.effects import VISCOSITY, LengthYieldEffects
from pam_envs.muscle.law_correction import FIELDS
from pam_envs.parameters import declarations, row_blocks
from pam_envs.plants.core.muscle_path import PATH_NAMES, WARM
from pam_envs.sensing.sensor import SENSOR

YIELD_FIELDS = tuple(declarations(LengthYieldEffects))
COUNTS = ("key_a", "key_b", "episode", "step", "member")
"""Whole numbers of every plant; a count for each hysteresis operator follows."""


def each(names: str, size: int = 1) -> dict[str, int]:
    """Return blocks of rows of one size by name."""
    return dict.fromkeys(names.split(), size)


def dotted(**components: str) -> tuple[str, ...]:
    """Return parameter names: ``dotted(link="mass centre")`` is link.mass and link.centre."""
    return tuple(f"{part}.{name}" for part, names in components.items() for name in names.split())


def signal_rows(rows: Any, names: str) -> dict[str, int]:
    """Return rows of the state by name, from a module ``rows``."""
    return {name: getattr(rows, name.upper()) for name in names.split()}


def path_effects(
    *muscles: str,
    bearing: str | None = None,
    sensors: tuple[str, ...],
    law: str | None = None,
    yields: str | None = None,
    pair: str | None = None,
    viscous: str | None = None,
) -> dict[str, tuple[str, ...]]:
    """Return the names of the effects of muscle paths, a bearing, sensors and a law, by block.

    ``muscles`` are the components that have a temperature each (see ``core.muscle_path``), ``law``
    is that with the correction of the static law, ``yields`` that with yielding friction, ``pair``
    that of muscles in pairs, whose friction may differ and have a tail, ``viscous`` that with the
    viscosity.
    """
    rubs = {"bearing": dotted(**{bearing: " ".join(GUIDE._fields)})} if bearing else {}
    warm = {"warm": dotted(**dict.fromkeys(muscles, " ".join(WARM._fields)))}
    shown = {sensor: dotted(**{sensor: " ".join(SENSOR._fields)}) for sensor in sensors}
    maps = {"law": dotted(**{law: " ".join(FIELDS)})} if law else {}
    soft = {"soft": dotted(**{yields: " ".join(YIELD_FIELDS)})} if yields else {}
    uneven = {"uneven": dotted(**{pair: "friction_imbalance yield_tail"})} if pair else {}
    slow = {"viscous": dotted(**{viscous: " ".join(VISCOSITY._fields)})} if viscous else {}
    return {"path": PATH_NAMES} | warm | rubs | shown | maps | soft | uneven | slow


def layout(
    state: Mapping[str, int],
    parameters: tuple[str, ...],
    effects: Mapping[str, tuple[str, ...]],
    effect_state: Mapping[str, int],
    tables: Mapping[str, int] | None = None,
    operators: int = 1,
) -> dict[str, Any]:
    """Return the constants of a plant's module ``rows``.

    Beside a number for each row these are ``END`` (first row after the plant's state),
    ``N_PARAMETERS``, ``N_COUNTS``, ``EFFECT`` and ``STATE`` (named tuples of the first row of each
    block of effects, and of their state counted from the first row after the hysteresis), the
    names ``PARAMETERS``, ``EFFECTS`` and ``NAMES`` (both), and ``place``, which gives the row of a
    parameter by its dotted name.

    Parameters
    ----------
    state, effect_state : mapping
        Rows of each block of the plant's state and of that of its effects.
    parameters : tuple of str
        Dotted names.
    effects : mapping
        Dotted names by block, of parameters of effects, which are off in a plain plant.
    tables : mapping, optional
        Rows of what follows the named parameters; default: the hysteresis operator's numbers.
    operators : int
        Number of hysteresis operators.
    """
    off = tuple(name for names in effects.values() for name in names)
    names = parameters + off
    rows = row_blocks(**state)
    fixed = row_blocks(
        **dict.fromkeys((name.replace(".", "_") for name in names), 1),
        **({"model": NUMBERS} if tables is None else tables),
    )
    counts = row_blocks(**dict.fromkeys(COUNTS, 1), stack_count=operators)
    used = Counter([*counts._fields, *fixed._fields, *rows._fields])
    if twice := [name for name, number in used.items() if number > 1 and name != "end"]:
        raise ValueError(f"two rows are named {', '.join(twice)}: rename one of them")
    found: dict[str, Any] = {}
    for block in (counts, fixed, rows):
        found |= {name.upper(): row for name, row in block._asdict().items()}
    sizes = {block: len(members) for block, members in effects.items()}
    return found | {
        "N_COUNTS": counts.end,
        "N_PARAMETERS": fixed.end,
        "PARAMETERS": parameters,
        "EFFECTS": off,
        "NAMES": names,
        "EFFECT": row_blocks(len(parameters), **sizes),
        "STATE": row_blocks(**effect_state),
        "place": names.index,
    }
