"""Detection of wrong units, with the factor that corrects a column."""

import math

import numpy as np

from pam_envs.constants import BAR, GRAVITY, MM
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig

PRESSURES = {
    "kPa": (100.0, "divide by 100"),
    "MPa": (0.1, "multiply by 10"),
    "psi": (14.5038, "divide by 14.504"),
    "Pa": (1e5, "divide by 1e5"),
    "mbar": (1e3, "divide by 1000"),
}
"""Other units of pressure: number of units in a bar, and the correction."""
HIGHEST, DECLARED = 15.0, 1.25
"""Highest gauge pressure of muscles [bar], and over the pressure that RIG.yaml declares."""
USUAL = 6.0  # usual gauge pressure of muscles [bar]
LARGEST_SHARE = 0.4  # largest contraction of a muscle over its rest length
SMALLEST_STROKE, SMALLEST_SHARE = 0.5e-3, 0.002
"""Smallest stroke of a muscle [m], and over its rest length, over a wide range..."""
WIDE, WIDE_SHARE = 3.0 * BAR, 0.6
"""... of pressures: its width [Pa], and over the regulator's range."""
FOLLOWS = 0.5  # correlation with the command above which a contraction follows it


def wrong_units(recording: Recording, rig: Rig) -> tuple[list[str], list[str]]:
    """Return problems and warnings on columns with wrong units."""
    problems = _command(recording, rig)
    problems += [] if problems else _pressure(recording, rig)
    problems += _contraction(recording, rig)
    wrong, warnings = _load(recording)
    return problems + wrong, warnings + _suspicions(recording, rig)


def _advice(value: float, expected: float) -> str:
    """Return the unit in which ``value`` is nearest to ``expected`` [bar], and its correction."""
    if value > 0.0:
        distance = {
            unit: abs(math.log(value / number / expected))
            for unit, (number, _) in PRESSURES.items()
        }
        unit = min(distance, key=lambda name: distance[name])
        if distance[unit] < math.log(2.5):
            return f"it looks like {unit}: {PRESSURES[unit][1]}"
    if value > HIGHEST:
        return (
            f"check its unit, or declare regulator.max_pressure_bar above {HIGHEST:g} in RIG.yaml"
        )
    return "no muscle runs at this pressure; check its unit"


def _limit(rig: Rig) -> float:
    """Return the pressure [bar] above which readings have another unit."""
    return max(HIGHEST, DECLARED * (rig.max_pressure or 0.0) / BAR)


def _command(recording: Recording, rig: Rig) -> list[str]:
    highest, limit = float(np.max(recording.command)) / BAR, _limit(rig)
    expected = USUAL if rig.max_pressure is None else rig.max_pressure / BAR
    if highest > limit:
        return [f"pressure_command_bar goes up to {highest:.4g}; {_advice(highest, expected)}"]
    pressure = 0.0 if recording.pressure is None else float(np.max(recording.pressure)) / BAR
    if highest < 0.25 * pressure and 0.5 < pressure <= limit:
        return [
            f"pressure_command_bar never exceeds {highest:.3g} while the pressure goes to "
            f"{pressure:.3g} bar; {_advice(highest, pressure)}"
        ]
    return []


def _pressure(recording: Recording, rig: Rig) -> list[str]:
    if recording.pressure is None:
        return []
    free = ~recording.valve_closed & ~recording.filled
    if not free.any():
        return []
    highest = float(np.quantile(recording.pressure[free], 0.995)) / BAR
    command = float(np.quantile(recording.command[free], 0.995)) / BAR
    if highest > _limit(rig):
        return [f"pressure_bar goes up to {highest:.4g}; {_advice(highest, command)}"]
    if command > 1.0 and highest < 0.25 * command:
        return [
            f"pressure_bar never exceeds {highest:.3g} while the command goes to {command:.3g} "
            f"bar; {_advice(highest, command)}"
        ]
    return []


def _contraction(recording: Recording, rig: Rig) -> list[str]:
    if recording.contraction is None:
        return []
    metres = _metres(recording, rig)
    if metres:
        return metres
    largest = float(np.max(np.abs(recording.contraction)))
    if rig.rest_length is None or largest <= LARGEST_SHARE * rig.rest_length:
        return []
    falls = _follows(recording) < -FOLLOWS
    advice = "it looks like the muscle's length: give rest length minus length"
    return [
        f"contraction_mm goes up to {largest / MM:.4g} mm, more than {LARGEST_SHARE:.0%} of the "
        f"rest length of {rig.rest_length / MM:.4g} mm; "
        + (advice if falls else "check its unit and the rest length")
    ]


def _metres(recording: Recording, rig: Rig) -> list[str]:
    """Return a problem with a stroke that is too small for the range of pressures."""
    assert recording.contraction is not None
    wide = WIDE if rig.max_pressure is None else WIDE_SHARE * rig.max_pressure
    if np.ptp(recording.command) < wide or _follows(recording) < FOLLOWS:
        return []
    stroke = float(np.ptp(recording.contraction))
    least = SMALLEST_STROKE
    if rig.rest_length is not None:
        least = max(least, SMALLEST_SHARE * rig.rest_length)
    if stroke >= least:
        return []
    span = float(np.ptp(recording.command)) / BAR
    return [
        f"contraction_mm spans only {stroke / MM:.3g} mm over {span:.3g} bar; it looks like "
        "metres: multiply by 1000"
    ]


def _follows(recording: Recording) -> float:
    """Return the correlation of contraction and command."""
    if recording.contraction is None or np.ptp(recording.contraction) == 0.0:
        return 0.0
    if np.ptp(recording.command) == 0.0:
        return 0.0
    return float(np.corrcoef(recording.contraction, recording.command)[0, 1])


def _load(recording: Recording) -> tuple[list[str], list[str]]:
    heaviest = float(np.max(recording.load))
    if np.min(recording.load) < 0.0:
        return [
            f"load_N goes down to {np.min(recording.load):.3g} N; a muscle pulls: give the pull "
            "on it as a positive number"
        ], []
    if heaviest <= 0.0:
        return [], []
    if recording.force is not None:
        loaded = recording.load > 0.5 * heaviest
        ratio = float(np.median(recording.force[loaded] / recording.load[loaded]))
        if abs(ratio / GRAVITY - 1.0) < 0.1:
            return [
                f"force_N is {ratio:.3g} times load_N; load_N looks like kilograms: multiply by "
                "9.80665"
            ], []
    if heaviest <= 10.0:
        return [], [
            f"the heaviest load is {heaviest:.3g} N; if load_N is in kilograms, multiply by 9.80665"
        ]
    return [], []


def _suspicions(recording: Recording, rig: Rig) -> list[str]:
    """Return warnings on unusual values."""
    warnings = []
    highest = float(np.max(recording.command))
    if highest <= 0.05 * BAR:
        warnings.append(
            f"pressure_command_bar never exceeds {highest / BAR:.3g} bar: nothing is excited"
        )
    if rig.max_pressure is not None and highest > 1.02 * rig.max_pressure:
        warnings.append(
            f"the command goes to {highest / BAR:.3g} bar, above the regulator's "
            f"{rig.max_pressure / BAR:.3g} bar"
        )
    if rig.max_pressure is not None and 0.05 <= highest / BAR <= 0.105 * rig.max_pressure / BAR:
        warnings.append(
            f"the command goes to {highest / BAR:.3g} bar of {rig.max_pressure / BAR:.3g}; if the "
            "pressures are in MPa, multiply by 10"
        )
    if recording.pressure is not None:
        offset = float(np.median(recording.pressure - recording.command)) / BAR
        if abs(offset - 1.013) < 0.08:
            warnings.append(
                f"pressure_bar is {offset:.3g} bar above the command; gauge pressure is expected: "
                "if it is absolute, subtract 1.013"
            )
    if recording.contraction is not None and highest > BAR:
        span = float(np.ptp(recording.contraction)) / MM
        if 0.0 < span < 0.1:
            warnings.append(
                f"contraction_mm spans only {span:.3g} mm; if it is in metres, multiply by 1000"
            )
        if _follows(recording) < -FOLLOWS:
            warnings.append(
                "contraction_mm falls as the pressure rises; contraction is rest length minus "
                "length: check its sign"
            )
    return warnings
