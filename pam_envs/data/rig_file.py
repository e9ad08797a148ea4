"""Declared facts of a rig: ``RIG.yaml``.

    plant: single_muscle
    muscle: {rest_length_mm: 200, diameter_mm: 10, family: festo_dmsp}
    regulator: {max_pressure_bar: 6}
    load: hanging_mass            # or constant_force
    sensors: {contraction_noise_mm: 0.03, pressure_noise_bar: 0.008}
    history: {cycles_since_rest: 0, rezeroed: false, settled: true}
    clock: {tolerance_ms: 0}      # largest offset between the clocks of command and readings
    repeats: [[holds_a, holds_b]] # segments that repeat one another
    valve_closed: [shut]          # segments during which the valve is shut
    tolerance: {mass.load: 0.02}  # relative tolerance of known parameters
    parameters: {link.length: 0.3} # known parameters of the plant [SI]
    variant: {mounting: rig}      # choices of the plant, for example of a knee orthosis
    channels: {pressure_bar: {from: AI/pressure, unit: kPa}}  # of a log file, by column

Every key but ``plant`` may be missing. The noise of other plants' sensors is declared under the
name of the column (``angle_noise_deg`` of ``angle_deg``).
"""

import dataclasses
import hashlib
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

from pam_envs import yaml_file
from pam_envs.constants import BAR, MM
from pam_envs.data.channel_sources import ChannelSource, sources_of
from pam_envs.data.recording.channels import WIRINGS
from pam_envs.wording import near, shown

Load = Literal["hanging_mass", "constant_force"]
MUSCLES = ("festo_mas", "festo_dmsp", "mckibben")
"""Families of :mod:`pam_envs.plants.single_muscle.families`."""


class Bounds(NamedTuple):
    """Number of the file: its key, its unit in SI and its bounds."""

    key: str
    unit: str
    scale: float
    low: float
    high: float


NUMBERS = {
    "rest_length": Bounds("muscle.rest_length_mm", "mm", MM, 10.0, 5000.0),
    "diameter": Bounds("muscle.diameter_mm", "mm", MM, 1.0, 100.0),
    "braid_angle": Bounds("muscle.braid_angle_deg", "deg", math.radians(1.0), 12.0, 50.0),
    "max_pressure": Bounds("regulator.max_pressure_bar", "bar", BAR, 0.1, 30.0),
    "contraction_noise": Bounds("sensors.contraction_noise_mm", "mm", MM, 1e-5, 10.0),
    "pressure_noise": Bounds("sensors.pressure_noise_bar", "bar", BAR, 1e-6, 1.0),
    "clock_tolerance": Bounds("clock.tolerance_ms", "ms", 1e-3, 0.0, 1000.0),
}
"""Fields of :class:`Rig` that are numbers with a unit."""
SECTIONS: dict[str, tuple[str, ...]] = {
    "muscle": ("rest_length_mm", "diameter_mm", "family", "braid_angle_deg"),
    "regulator": ("max_pressure_bar",),
    "sensors": ("contraction_noise_mm", "pressure_noise_bar"),
    "history": ("cycles_since_rest", "rezeroed", "settled"),
    "clock": ("tolerance_ms",),
}
KEYS = (
    "plant",
    *SECTIONS,
    "load",
    "repeats",
    "valve_closed",
    "tolerance",
    "parameters",
    "variant",
    "channels",
)


@dataclasses.dataclass(frozen=True)
class Rig:
    """Declared facts of the rig that a recording was taken on.

    Attributes
    ----------
    plant : str
        Family of the plant to replay the recording through.
    rest_length, diameter : float or None
        Of the muscle [m].
    family : str
        Family of the muscle's base plant (:mod:`pam_envs.plants.single_muscle.families`); empty:
        the one that is nearest to the recording.
    braid_angle : float or None
        Angle between threads and axis at rest [rad].
    max_pressure : float or None
        Largest gauge pressure that the regulator gives [Pa].
    load : {"hanging_mass", "constant_force"}
        Whether the load is accelerated with the muscle's end or pulls with its force alone.
    contraction_noise, pressure_noise : float or None
        RMS of the sensors' noise [m], [Pa].
    cycles_since_rest : int
        Cycles that the muscle had made before the first row, since it last rested.
    rezeroed : bool
        Whether the position sensor was zeroed again at the start of each segment.
    settled : bool
        Whether the muscle was at rest, vented and settled at the first row and at every restart of
        the clock.
    clock_tolerance : float or None
        Largest offset of the readings' clock from that of the command [s]; None if unknown.
    repeats : tuple of tuple of str
        Groups of segments with the same experiment.
    valve_closed : tuple of str
        Segments during which the valve is shut, so that the command has no effect.
    tolerance : mapping of str to float
        Plant parameters that are known, with the relative error within which they are.
    noise : mapping of str to float
        RMS of the noise of other plants' outputs, by channel [SI].
    parameters : mapping of str to float
        Known parameters of the plant, by dotted name [SI]; they start its fit.
    variant : mapping of str to str
        Choices of the plant that select a variant (``makes`` of its class).
    channels : mapping of str to ChannelSource
        Channels of the recording's file, by column; empty if the file has these columns itself.
    source : str
        Origin of the values.
    """

    plant: str = "single_muscle"
    rest_length: float | None = None
    diameter: float | None = None
    family: str = ""
    braid_angle: float | None = None
    max_pressure: float | None = None
    load: Load = "hanging_mass"
    contraction_noise: float | None = None
    pressure_noise: float | None = None
    cycles_since_rest: int = 0
    rezeroed: bool = False
    settled: bool = False
    clock_tolerance: float | None = None
    repeats: tuple[tuple[str, ...], ...] = ()
    valve_closed: tuple[str, ...] = ()
    tolerance: Mapping[str, float] = dataclasses.field(default_factory=dict)
    noise: Mapping[str, float] = dataclasses.field(default_factory=dict)
    parameters: Mapping[str, float] = dataclasses.field(default_factory=dict)
    variant: Mapping[str, str] = dataclasses.field(default_factory=dict)
    channels: Mapping[str, ChannelSource] = dataclasses.field(default_factory=dict)
    source: str = dataclasses.field(default="arguments", compare=False)

    @property
    def digest(self) -> str:
        """Sixteen hexadecimal digits that change with any value, except where columns are read."""
        unused = {"source", "channels"} | {
            k for k in ("family", "braid_angle") if not vars(self)[k]
        }
        values = {k: v for k, v in vars(self).items() if k not in unused}
        values["tolerance"] = dict(self.tolerance)
        for name in (
            "noise",
            "parameters",
            "variant",
        ):  # they leave the digests of other files alone
            given = dict(values.pop(name))
            values |= {name: given} if given else {}
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]

    def __post_init__(self) -> None:
        """Check every value; messages use the file's units."""
        for field, bounds in NUMBERS.items():
            if getattr(self, field) is None:
                continue
            value, slack = getattr(self, field) / bounds.scale, 1e-9 * bounds.high  # from SI
            _require(
                bounds.low - slack <= value <= bounds.high + slack,
                f"{bounds.key} = {value:g} {bounds.unit} is outside [{bounds.low:g}, "
                f"{bounds.high:g}] {bounds.unit}; correct the value or its unit, or leave it out",
            )
        _require(
            self.load in get_args(Load),
            f"load is {shown(self.load)}; choose hanging_mass or constant_force (the load in "
            "newton belongs into the recording's column load_N)",
        )
        _require(
            0 <= self.cycles_since_rest <= 1_000_000,
            f"history.cycles_since_rest = {self.cycles_since_rest} is outside [0, 1000000]; count "
            "the cycles since the muscle last rested",
        )
        named = Counter(label for group in self.repeats for label in group)
        for group in self.repeats:
            _require(
                len(group) >= 2,
                f"repeats holds the group {shown(list(group))}; name at least two segments that "
                "repeat one another, or leave the group out",
            )
        for label, times in named.items():
            _require(times == 1, f"repeats names the segment {shown(label)} twice; name it once")
        for name, value in self.noise.items():
            _require(
                value > 0.0,
                f"the noise of {name} is {value:g}; give its RMS, above 0, or leave it out",
            )
        for name, value in self.tolerance.items():
            _require(
                name.count(".") == 1,
                f"tolerance names {shown(name)}; name a parameter of the plant with its component, "
                "for example mass.load",
            )
            _require(
                0.0 < value <= 1.0,
                f"tolerance of {name} = {value:g} is outside (0, 1]; it is relative: give 0.02 for "
                "two per cent",
            )

    @classmethod
    def from_yaml(cls, path: str | Path) -> "Rig":
        """Read a rig file.

        Raises
        ------
        ValueError
            Naming the file, the key, its value and what to do.
        """
        where = f"rig file {path}"
        data = yaml_file.read(path, "rig file")
        with yaml_file.naming(where):
            if not isinstance(data, Mapping):
                raise ValueError(f"must hold a mapping with the keys {', '.join(KEYS)}")
            return cls(**_fields(data), source=str(path))


def _fields(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of :class:`Rig`, in SI."""
    _refuse_unknown(data, KEYS, "")
    plant = data.get("plant")
    wiring = WIRINGS.get(str(plant).strip())
    noises = {c.noise_key: c for c in wiring.outputs} if wiring else {}
    known = SECTIONS | ({"sensors": tuple(noises)} if wiring else {})
    sections = {name: _section(data.get(name), name, keys) for name, keys in known.items()}
    _require(
        isinstance(plant, str) and bool(plant.strip()),
        f"plant is {shown(plant)}; name the plant's family, for example plant: single_muscle",
    )
    given: dict[str, Any] = {"plant": str(plant).strip()}
    for field, bounds in NUMBERS.items():
        section, _, key = bounds.key.partition(".")
        if sections[section].get(key) is not None:
            number = _number(sections[section][key], bounds.key, bounds.unit)
            given[field] = number * bounds.scale
    given["noise"] = {
        noises[key].name: _number(value, f"sensors.{key}", noises[key].unit) * noises[key].scale
        for key, value in sections["sensors"].items()
        if key in noises and value is not None
    }
    given["parameters"] = _parameters(data.get("parameters"))
    given["variant"] = _variant(data.get("variant"))
    if sections["muscle"].get("family") is not None:
        given["family"] = _family(sections["muscle"]["family"])
    if data.get("load") is not None:
        given["load"] = data["load"]
    given |= _history(sections["history"])
    given["repeats"] = _repeats(data.get("repeats"))
    given["valve_closed"] = _labels(data.get("valve_closed"), "valve_closed")
    given["tolerance"] = _tolerance(data.get("tolerance"))
    given["channels"] = sources_of(data.get("channels"))
    return given


def _refuse_unknown(data: Mapping[Any, Any], known: Sequence[str], prefix: str) -> None:
    for key in data:
        if key not in known:
            home = [f"{s}.{k}" for s, keys in SECTIONS.items() for k in keys if k == key]
            hint = f"; did you mean {home[0]!r}?" if home else near(str(key), known)
            raise ValueError(f"unknown key {shown(prefix + str(key))}{hint}")


def _require(good: bool, message: str) -> None:
    if not good:
        raise ValueError(message)


def _section(value: Any, name: str, keys: tuple[str, ...]) -> Mapping[str, Any]:
    keyed = f"{name} must be a mapping with the keys {', '.join(keys)}, got {shown(value)}"
    _require(value is None or isinstance(value, Mapping), keyed)
    _refuse_unknown(value or {}, keys, f"{name}.")
    return value or {}


def _number(value: Any, key: str, unit: str) -> float:
    number = yaml_file.number(value)
    if number is None:
        raise ValueError(f"{key} must be a number in {unit}, got {shown(value)}")
    return number


def _family(value: Any) -> str:
    good = value in MUSCLES
    _require(good, f"muscle.family is {shown(value)}; choose one of {', '.join(MUSCLES)}")
    return str(value)


def _history(section: Mapping[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in section.items() if value is not None}
    for key, kind, what in (
        ("cycles_since_rest", int, "a whole number"),
        ("rezeroed", bool, "true or false"),
        ("settled", bool, "true or false"),
    ):
        good = key not in given or type(given[key]) is kind
        _require(good, f"history.{key} must be {what}, got {shown(given.get(key))}")
    return given


def _labels(value: Any, key: str) -> tuple[str, ...]:
    """Return segment labels; YAML makes numbers of those that look like numbers."""
    labels = [] if value is None else value
    good = isinstance(labels, list) and all(type(v) in (str, int, float) for v in labels)
    _require(good, f"{key} must be a list of segments, for example [holds_a], got {shown(value)}")
    return tuple(str(label).strip() for label in labels)


def _repeats(value: Any) -> tuple[tuple[str, ...], ...]:
    _require(
        value is None or isinstance(value, list),
        "repeats must be a list of groups of segments, for example [[holds_a, holds_b]], got "
        f"{shown(value)}",
    )
    return tuple(_labels(group, "each group of repeats") for group in value or [])


def _parameters(value: Any) -> dict[str, float]:
    _require(
        value is None or isinstance(value, Mapping),
        "parameters must be a mapping from parameter to value in SI, for example "
        f"{{link.length: 0.3}}, got {shown(value)}",
    )
    return {str(k): _number(v, f"parameters.{k}", "SI") for k, v in (value or {}).items()}


def _variant(value: Any) -> dict[str, str]:
    _require(
        value is None
        or (isinstance(value, Mapping) and all(isinstance(v, str) for v in value.values())),
        "variant must be a mapping from choice to word, for example {mounting: rig}, got "
        f"{shown(value)}",
    )
    return {str(k): v for k, v in (value or {}).items()}


def _tolerance(value: Any) -> dict[str, float]:
    _require(
        value is None or isinstance(value, Mapping),
        "tolerance must be a mapping from parameter to relative error, for example "
        f"{{mass.load: 0.02}}, got {shown(value)}",
    )
    given = (value or {}).items()
    return {str(k): _number(v, f"tolerance of {k}", "parts of one") for k, v in given}
