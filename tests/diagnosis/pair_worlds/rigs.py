"""Rigs of three worlds, drawn at random, and their recordings."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from tests.diagnosis.families.joint_rig import PERIOD, campaign

from . import engine as e
from .fields import ELEMENTS, MUSCLE, VALVE

WORLDS = {
    "braid": (e.BRAID, e.BOUC_WEN, e.SECOND_ORDER),
    "exponential": (e.EXPONENTIAL, e.DAHL, e.LIMITED_LAG),
    "polynomial": (e.POLYNOMIAL, e.MAXWELL_SLIP, e.ORIFICE),
}
"""Force law, friction and regulator of each world."""
SUBSTEPS = 40
NOISE = {"angle": 5e-4, "pressure": 400.0, "tension": 0.4}
"""Noise of the sensors [SI], by the first word of a channel."""
BAR = 1e5
STOP, CLEAR = 0.611, 0.53
"""Angle of the stops of a lever [rad], 5 degrees before its stretched muscle has no arm left, and
that within which a laboratory keeps a recording."""
LOWER, LEAST = 0.9, 0.3
"""Factor by which it lowers the amplitude of its setpoints until then, and the least amplitude."""
HIDDEN: dict[str, dict[str, float]] = {
    "creep": {"creep": 0.06},
    "stick_slip": {"stiction": 1.0},
    "valve_dead_band": {"band": 0.1},
    "unequal_muscles": {"unequal": 0.12},
    "sensor_delay": {"delay_s": 0.05},
    "viscous_loss": {"loss": 0.03},
}
"""Strength of each effect that a rig may hide; stiction over the family's usual one, the viscous
loss over the size of a muscle."""


@dataclass(frozen=True)
class Family:
    """Sizes of a family's rigs: muscles, geometry, link and motion.

    ``sizes`` are forces at 2 bar of the muscles of a joint [N]; ``joint`` are the fields of
    :data:`fields.JOINT` up to ``rest``; ``link`` is length [m], mass [kg], centre [m], first angle.
    ``stop`` is the angle of the mechanical stops [rad], on either side.
    """

    place: int
    sizes: tuple[float, ...]
    most: float  # largest contraction
    passive: float  # over the size
    geometry: tuple[float, float, float, float]
    joint: tuple[float, float, float, float, float]
    link: tuple[float, float, float, float]
    stiction: float  # usual one [N m]
    joints: int = 1
    stop: float = np.inf


FAMILIES: dict[str, Family] = {
    "antagonistic_joint": Family(
        e.LEVER,
        (140.0, 140.0),
        0.27,
        0.0,
        (0.0362, 0.1, 0.0619, 0.15),
        (0.0063, 0.05, 0.368, 0.0, 0.0),
        (0.25, 0.0, 0.0, 0.0),
        0.04,
        stop=STOP,
    ),
    "elbow_orthosis": Family(
        e.PULLEY,
        (115.0, 270.0),
        0.28,
        0.3,
        (0.0315, 0.0, 2.0944, 0.39),
        (0.085, 1.6, 3.4, 25.0, 1.11),  # with the wearer's stiffness and the weight of his arm
        (0.3, 0.0, 0.0, 1.1),
        0.3,
    ),
    "knee_orthosis": Family(
        e.BRACE,
        (260.0,),
        0.32,
        0.0,
        (0.14, 0.0094, 0.0, 0.25),
        (0.02, 1.0, 0.0, 30.0, 2.3422),
        (0.3, 0.0, 0.0, 2.0),
        0.3,
    ),
    "redundant_manipulator": Family(
        e.LEVER,
        (140.0, 140.0),
        0.27,
        0.0,
        (0.0362, 0.1, 0.0619, 0.15),
        (0.0021, 0.1, 0.0, 0.0, 0.0),
        (0.25, 0.1, 0.125, 0.0),
        0.04,
        joints=2,
        stop=STOP,
    ),
}


def _polynomial(random: np.random.Generator) -> dict[str, float]:
    """Draw the fields of a muscle that only the polynomial law and the Maxwell slip have."""
    parts = random.uniform(0.4, 1.6, ELEMENTS)
    values = {
        "curve": random.uniform(0.15, 0.45),
        "skew": random.uniform(0.0, 0.5),
        "threshold": random.uniform(0.08, 0.3),
        "stiffening": random.uniform(-0.03, 0.03),
        "bladder": random.uniform(0.06, 0.14),
        "power": random.uniform(0.6, 1.4),
    }
    values |= {f"part_{k}": parts[k] / parts.sum() for k in range(ELEMENTS)}
    # one in every octave from a third of the onset
    return values | {f"break_{k}": 2.0 ** random.uniform(k - 1.6, k - 0.6) for k in range(ELEMENTS)}


def _muscles(
    family: Family,
    random: np.random.Generator,
    hidden: Mapping[str, float],
    law: int = e.BRAID,
) -> np.ndarray:
    """Draw the muscles of a joint, alike but for their size, and repeat them for every joint."""
    shape = {
        "most": family.most * random.uniform(0.95, 1.05),
        "curve": random.uniform(0.9, 1.3),
        "onset": random.uniform(0.003, 0.007),
        "viscous": random.uniform(0.5, 3.0),
        "creep": hidden.get("creep", 0.0),
        "creep_s": random.uniform(3.0, 8.0),
    }
    spread, friction = random.uniform(0.9, 1.1), random.uniform(0.02, 0.04)
    if law == e.POLYNOMIAL:
        shape |= _polynomial(random)
    made = []
    for k, size in enumerate(family.sizes):
        own = size * spread * (1.0 + (0.5 - k) * hidden.get("unequal", 0.0))
        values = shape | {
            "size": own,
            "passive": family.passive * own,
            "friction": friction * own,
            "growth": 0.3 * friction * own,
            "loss": hidden.get("loss", 0.0) * own,
        }
        made.append([values.get(name, 0.0) for name in MUSCLE])
    return np.array(made * family.joints)


def _valve(kind: int, random: np.random.Generator, hidden: Mapping[str, float]) -> np.ndarray:
    """Draw a regulator."""
    if kind == e.ORIFICE:
        return _orifice(random, hidden)
    quick = kind == e.SECOND_ORDER
    values = {
        "rate": random.uniform(22.0, 35.0) if quick else 1.0 / random.uniform(0.035, 0.07),
        "damping": random.uniform(0.9, 1.3),
        "limit": random.uniform(5.0, 9.0),
        "gain": random.uniform(0.99, 1.01),
        "offset": 0.0,
        "dead_s": random.uniform(0.01, 0.04),
        "band": hidden.get("band", 0.0),
    }
    return np.array([values.get(name, 0.0) for name in VALVE])


def _orifice(random: np.random.Generator, hidden: Mapping[str, float]) -> np.ndarray:
    """Draw a proportional valve with its controller."""
    values = {
        "rate": 1.0 / random.uniform(0.025, 0.05),
        "limit": random.uniform(10.0, 16.0),
        "gain": random.uniform(0.99, 1.01),
        "dead_s": random.uniform(0.01, 0.04),
        "band": hidden.get("band", 0.0),
        "reset_s": random.uniform(0.6, 1.2),
        "spool_s": random.uniform(0.004, 0.008),
        "supply": random.uniform(7.0, 9.0),
        "vent": random.uniform(2.0, 3.0),
        "widening": random.uniform(1.5, 3.5),
        "choke": random.uniform(0.2, 0.5),
    }
    return np.array([values.get(name, 0.0) for name in VALVE])


def record(
    name: str, world: str, seed: int, hidden: Mapping[str, float] | None = None
) -> tuple[Recording, Rig]:
    """Return a recording of a rig with hidden effects, and its rig file.

    Parameters
    ----------
    name, world : str
        Family of the plant, and world of the rig.
    seed : int
        Of rig and noise.
    hidden : mapping
        Values of :data:`HIDDEN`.
    """
    hidden = hidden or {}
    inputs, labels = campaign(1)
    family, pair = FAMILIES[name], (inputs["set_point_a"], inputs["set_point_b"])
    payload = inputs["payload"] if name == "antagonistic_joint" else np.zeros(len(labels))
    amplitude = 1.0
    while name == "redundant_manipulator" and amplitude > LEAST:
        tried = _commands(family, pair, amplitude)
        angles, *_ = _run(name, world, np.random.default_rng(seed), {}, tried, payload)
        if np.abs(angles).max() < CLEAR:
            break
        amplitude *= LOWER
    commands, random = _commands(family, pair, amplitude), np.random.default_rng(seed)
    found = _run(name, world, random, hidden, commands, payload)
    return _recording(name, commands, payload, found, hidden, random)


def _commands(
    family: Family, pair: tuple[np.ndarray, np.ndarray], amplitude: float
) -> list[np.ndarray]:
    """Return the setpoints [Pa] of all muscles, from those of a pair and the part of the swing."""
    a, b = pair
    mean, half = 0.5 * (a + b), 0.5 * amplitude * (a - b)
    commands = [mean + half, mean - half] if amplitude < 1.0 else [a, b]
    commands = commands[: len(family.sizes)]
    if family.joints == 2:
        commands += [np.roll(c, len(a) // 3) for c in commands]
    return commands


def _run(
    name: str,
    world: str,
    random: np.random.Generator,
    hidden: Mapping[str, float],
    commands: list[np.ndarray],
    payload: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw a rig and return its angles [rad], pressures [Pa] and forces [N], each (n, rows)."""
    family = FAMILIES[name]
    law, friction, regulator = WORLDS[world]
    muscles = _muscles(family, random, hidden, law)
    valve = _valve(regulator, random, hidden)
    joint = np.array(family.joint) * np.array([*random.uniform(0.85, 1.15, 4), 1.0])
    bearing = [hidden.get("stiction", 0.0) * family.stiction, 0.55, 0.05, 2e-3]
    angles, pressures, forces = e.run(
        np.array([law, friction, regulator, family.place]),
        muscles,
        valve,
        np.array([[*joint, *bearing]] * family.joints),
        np.array(family.geometry),
        np.array([*family.link, family.stop]),
        np.array(commands) / BAR,
        payload,
        PERIOD,
        SUBSTEPS,
    )
    return angles, BAR * pressures, forces


def _recording(
    name: str,
    commands: list[np.ndarray],
    payload: np.ndarray,
    found: tuple[np.ndarray, np.ndarray, np.ndarray],
    hidden: Mapping[str, float],
    random: np.random.Generator,
) -> tuple[Recording, Rig]:
    """Return the noisy readings of a run as a recording, and the rig file."""
    angles, pressures, forces = found
    labels = campaign(1)[1]
    time = PERIOD * np.arange(len(labels))
    late = hidden.get("delay_s", 0.0)
    angles = np.array([np.interp(time - late, time, values) for values in angles])
    if name == "knee_orthosis":
        outputs = {"angle": angles[0], "pressure": pressures[0], "tension": forces[0]}
        inputs = {"set_point": commands[0]}
    elif name == "redundant_manipulator":
        outputs = {f"angle_{k}": values for k, values in enumerate(angles)}
        outputs |= {f"pressure_{k}": values for k, values in enumerate(pressures)}
        inputs = {f"set_point_{k}": values for k, values in enumerate(commands)}
    else:
        outputs = {"angle": angles[0], "pressure_a": pressures[0], "pressure_b": pressures[1]}
        inputs = {"set_point_a": commands[0], "set_point_b": commands[1]}
        more = {"payload": payload} if name == "antagonistic_joint" else {}
        inputs |= more or {"intent": np.full(len(time), 1.11)}
    noise = {key: NOISE[key.partition("_")[0]] for key in outputs}
    noisy = {k: v + random.normal(0.0, noise[k], len(time)) for k, v in outputs.items()}
    made = Recording.of_channels(time, inputs, noisy, plant=name, segment=labels)
    return made, Rig(plant=name, noise=noise, settled=True)
