"""The next experiment: which of a list makes the fitted rivals differ most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.cause import Cause
from pam_envs.mechanics.hanging_mass import GRAVITY
from pam_envs.plants.replay import Inputs, replay
from pam_envs.plants.single_muscle import SingleMuscle

Array = NDArray[np.float64]

PERIOD = 0.02
ENOUGH = 1.0
"""Mean squared difference of the rivals, in noise variances, that an experiment has to promise."""
KELVIN = 293.15


@dataclass(frozen=True)
class Plan:
    """An experiment that may be done.

    Attributes
    ----------
    name, description : str
        In words.
    command : ndarray, shape (n,)
        Set-points over the largest; below zero: valve shut.
    load : ndarray, shape (n,)
        [N].
    kelvin : ndarray, shape (n,)
        Temperature over the usual [K].
    """

    name: str
    description: str
    command: Array
    load: Array
    kelvin: Array


def _plan(
    name: str, description: str, command: Sequence[Array], load: float = 30.0, warm: float = 0.0
) -> Plan:
    levels = np.concatenate(command)
    n = len(levels)
    rise = warm * np.minimum(1.0, np.arange(n) / max(1, n // 2))
    return Plan(name, description, levels, np.full(n, load), rise)


def _hold(level: float, seconds: float) -> Array:
    return np.full(round(seconds / PERIOD), level)


def _ramp(low: float, high: float, seconds: float) -> Array:
    return np.linspace(low, high, round(seconds / PERIOD))


def _sine(middle: float, swing: float, hertz: float, seconds: float) -> Array:
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    return np.asarray(middle - swing * np.cos(2.0 * np.pi * hertz * t))


def plans() -> tuple[Plan, ...]:
    """Return the experiments to choose from, each of 60 to 120 s."""
    rest = _hold(0.0, 3.0)
    triangle = [_ramp(0.0, 0.95, 10.0), _ramp(0.95, 0.0, 10.0)]
    small = [_ramp(0.45, 0.55, 3.0), _ramp(0.55, 0.45, 3.0)] * 4
    cycles = [_ramp(0.0, 0.9, 1.5), _ramp(0.9, 0.0, 1.5)] * 12
    steps = [_hold(v, 2.0) for v in (0.1, 0.2, 0.1, 0.4, 0.1, 0.7, 0.1, 0.95, 0.1)]
    stairs = [_hold(v / 10.0, 4.0) for v in (*range(1, 10), *range(8, 0, -1))]
    fast = [_sine(0.5, 0.35, f, 12.0) for f in (0.2, 0.5, 1.0, 2.0)]
    tiny = [_sine(0.5, s, 1.0, 10.0) for s in (0.02, 0.05, 0.1, 0.2)]
    shut = [_hold(0.4, 3.0), _hold(-1.0, 30.0), _hold(0.8, 3.0), _hold(-1.0, 30.0)]
    both = [_hold(0.2, 5.0), _hold(0.5, 25.0), _hold(0.9, 5.0), _hold(0.5, 25.0)]
    full = [v for _ in range(8) for v in (_hold(0.98, 1.0), _hold(0.1, 0.8))]
    made = [
        _plan("long_hold", "hold half the pressure for 60 s", [rest, _hold(0.5, 60.0), rest]),
        _plan("both_sides", "hold one pressure, reached from below and from above", [rest, *both]),
        _plan("slow_triangle", "ramp up and down slowly", [rest, *triangle, *triangle]),
        _plan("minor_loops", "small triangles about half the pressure", [rest, *triangle, *small]),
        _plan("cycles_after_rest", "rest overnight, then cycle", [rest, *cycles]),
        _plan("three_step_sizes", "steps of several sizes", [rest, *steps, *steps]),
        _plan("staircase", "stairs of 4 s up and down", [rest, *stairs]),
        _plan("frequencies", "one swing at 0.2, 0.5, 1 and 2 Hz", [rest, *fast]),
        _plan("amplitudes", "1 Hz at four small swings", [rest, *tiny]),
        _plan("valve_shut", "shut the valve for 30 s at two pressures", [rest, *shut]),
        _plan("full_pressure", "fill to the top again and again", [rest, *full, *full]),
        _plan(
            "warm_muscle", "stairs while the muscle is warmed by 10 K", [rest, *stairs], 30.0, 10.0
        ),
        _plan("heavy_load", "slow triangles under 60 N", [rest, *triangle, *triangle], 60.0),
        _plan("no_load", "slow triangles without load", [rest, *triangle, *triangle], 0.0),
    ]
    return (*made, _load_change(rest, triangle))


def _load_change(rest: Array, triangle: list[Array]) -> Plan:
    one = np.concatenate([rest, *triangle])
    loads = (0.0, 15.0, 30.0, 45.0, 60.0)
    return Plan(
        "five_loads",
        "the same slow triangle under 0, 15, 30, 45 and 60 N",
        np.tile(one, len(loads)),
        np.repeat(loads, len(one)),
        np.zeros(len(one) * len(loads)),
    )


def inputs_of(plan: Plan, full: float) -> Inputs:
    """Return a plan's inputs for a largest pressure [Pa]."""
    n = len(plan.command)
    fresh = np.zeros(n, bool)
    fresh[0] = True
    command = np.where(plan.command < 0.0, -1.0, plan.command * full)
    return Inputs(
        PERIOD,
        command,
        plan.load / GRAVITY,
        plan.kelvin + KELVIN,
        fresh,
        np.zeros(n),
        np.zeros(n, bool),
    )


def separation(first: SingleMuscle, second: SingleMuscle, plan: Plan, noise: Array) -> float:
    """Return the mean squared difference of two plants in a plan, in noise variances.

    Summed over the outputs; a constant offset, which zeroing the sensors again takes away, does
    not count.
    """
    inputs = inputs_of(plan, first.regulator.max_pressure)
    a, b = replay(first, inputs), replay(second, inputs)
    total = 0.0
    for name, sd in zip(a, noise, strict=True):
        total += float(np.var((a[name] - b[name]) / sd))
    return total


def propose(
    first: SingleMuscle,
    second: SingleMuscle,
    names: tuple[str, str],
    noise: Array,
    causes: Sequence[Cause],
    allowed: Callable[[Plan], bool] = lambda plan: True,
) -> dict[str, Any]:
    """Return the plan in which two fitted rivals differ most, as the report holds it.

    Parameters
    ----------
    first, second : SingleMuscle
        The rivals, fitted.
    names : tuple of str
        Their causes.
    noise : ndarray, shape (channels,)
        Of the sensors.
    causes : sequence of Cause
        Where the sensor that would measure one directly is looked up.
    allowed : callable
        Which plans can be done.
    """
    scored = [(separation(first, second, p, noise), p) for p in plans() if allowed(p)]
    best, plan = max(scored, key=lambda pair: pair[0])
    enough = best >= ENOUGH
    by_name = {c.name: c for c in causes}
    parts = [n for joined in names for n in joined.split("+")]
    differing = [n for n in dict.fromkeys(parts) if not all(n in j.split("+") for j in names)]
    sensors = [by_name[n].sensor for n in differing if n in by_name and by_name[n].sensor]
    return {
        "between": list(names),
        "name": plan.name,
        "description": plan.description
        if enough
        else "no experiment of the list tells them apart; a further sensor would",
        "segments": _segments(plan),
        "separation": best,
        "enough": bool(enough),
        "sensor": "; ".join(dict.fromkeys(sensors)),
    }


def _segments(plan: Plan) -> list[dict[str, Any]]:
    """Return a plan as pieces of straight command under one load."""
    bends = np.abs(np.diff(plan.command, 2)) > 1e-9
    cuts = np.flatnonzero(bends | (np.diff(plan.load[1:]) != 0)) + 1
    edges = [0, *cuts[np.r_[True, np.diff(cuts) > 1]].tolist(), len(plan.command) - 1]
    if len(edges) > 60:  # a curve: said in words
        return [{"seconds": len(plan.command) * PERIOD, "load_N": float(plan.load[0])}]
    return [
        {
            "seconds": round((b - a) * PERIOD, 3),
            "from": round(float(plan.command[min(a + 1, len(plan.command) - 1)]), 4),
            "to": round(float(plan.command[b]), 4),
            "load_N": float(plan.load[b]),
        }
        for a, b in pairwise(edges)
        if b > a
    ]
