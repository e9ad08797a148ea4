"""Tables of a synthetic muscle, independent of the library's models.

Its spring, the spread of its friction and the way a load acts are other functions than those that
the diagnosis fits.
"""

import numpy as np

from pam_envs.data.tables import ContractionTable

BAR, MM = 1e5, 1e-3
PRESSURES = np.concatenate([np.arange(0.0, 6.25, 0.5), np.arange(5.5, -0.25, -0.5)])
GRID = np.linspace(-5.0, 30.0, 7001)


def spring(x):
    """Return the pressure [bar] that holds a contraction [mm]."""
    return 0.9 * np.tanh(x / 1.6) + 0.26 * x + 0.0009 * np.abs(x) ** 2.5 * np.sign(x)


def hysteresis(pressure, friction, scale=lambda p: p):
    """Return the pressure [bar] that pulls: relays whose half widths spread like a bell."""
    half = np.clip(friction * (1.0 + 0.45 * np.linspace(-2.0, 2.0, 41)), 0.0, None)
    share = np.exp(-0.5 * np.linspace(-2.0, 2.0, 41) ** 2)
    share *= 0.9 / share.sum()
    state, out = np.zeros(41), []
    for value in scale(pressure):
        state = np.minimum(np.maximum(state, value - half), value + half)
        out.append(0.1 * value + share @ state)
    return np.array(out)


def table(
    loads=(0.0, 2.55, 4.55),
    repeats=5,
    seed=0,
    noise=0.15,
    shift=lambda m: 0.0,
    width=lambda m: 1.0,
    bend=0.0,
    pressures=PRESSURES,
):
    """Return readings; ``shift`` [bar] and ``width`` are functions of the load [kg]."""
    random, rows = np.random.default_rng(seed), []
    inflating = np.arange(len(pressures)) <= np.argmax(pressures)
    for load in loads:
        # friction that grows or falls along the range: the operator works on a warped scale
        warped = hysteresis(pressures, 0.45 * width(load), lambda p: p * np.exp(bend * (1 - p / 6)))
        ends = np.linspace(0.0, 8.0, 4001)
        pull = np.interp(warped, ends * np.exp(bend * (1 - ends / 6)), ends)
        x = np.interp(pull - shift(load), spring(GRID), GRID)
        for repeat in range(1, repeats + 1):
            read = np.round((x + noise * random.standard_normal(len(x))) / 0.05) * 0.05
            read[0] = 0.0
            rows += [
                (load, way, p, repeat, value)
                for way, p, value in zip(inflating, pressures, read, strict=True)
            ]
    load, way, p, repeat, value = (np.array(column) for column in zip(*rows, strict=True))
    return ContractionTable(
        load_kg=load.astype(float),
        inflating=way.astype(bool),
        pressure_pa=p * BAR,
        repeat=repeat.astype(np.int64),
        contraction_m=value * MM,
    )
