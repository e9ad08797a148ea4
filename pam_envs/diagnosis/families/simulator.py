"""Any simulation as a diagnosable plant: a function of parameters and inputs."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import yaml

from pam_envs.arrays import Array, Flags
from pam_envs.data.recording.channels import Channel
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import Audit, audit_channels
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.families.compiled import UsualStart, calibrate_compiled
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.calibrate import Calibration
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.plant_protocol import Experiment, Output, Signals
from pam_envs.files import write_text
from pam_envs.parameters import Declaration
from pam_envs.wording import near

FULL = 5e5
"""Size [Pa] to which a driving signal is scaled, of usual pressures."""

Values = Mapping[str, float]
Simulate = Callable[[dict[str, float], dict[str, Array], float], Mapping[str, Any]]


@dataclass(frozen=True)
class Quantity:
    """Parameter of a simulation.

    Attributes
    ----------
    value : float
        Starting value [SI]; of an effect the one that switches it off.
    unit : str
        In SI.
    low, high : float
        Bounds [SI] within which the parameter is physical.
    effect : bool
        Whether it belongs to a cause; all others are refitted in every model.
    scale : float, optional
        Size [SI] of a meaningful change; default: a tenth of the value, or a thousandth of the
        bounds.
    log : bool
        Whether it is fitted on a logarithmic scale.
    """

    value: float
    unit: str
    low: float
    high: float
    effect: bool = False
    scale: float | None = None
    log: bool = False

    @property
    def step(self) -> float:
        """Size of a meaningful change."""
        return self.scale or 0.1 * abs(self.value) or 1e-3 * (self.high - self.low)


@dataclass(frozen=True)
class Simulator:
    """Simulation of a plant, given as a function.

    Attributes
    ----------
    simulate : callable
        From parameters by name, inputs by name, each of shape (T,), and the sampling period [s] to
        outputs by name, each of shape (T,), read at the beginning of each period. It begins at
        rest, and is called for each run of a recording.
    parameters : mapping of str to Quantity
        Parameters by name.
    inputs : tuple of Channel
        Inputs; the first one is that over which residuals are shown.
    outputs : tuple of Channel
        Outputs, the motion first.
    causes : tuple of Cause
        Causes; the names of their terms are those of parameters with ``effect``.
    name : str
        Name of the plant in reports.
    """

    simulate: Simulate
    parameters: Mapping[str, Quantity]
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    causes: tuple[Cause, ...]
    name: str = "simulator"
    provenance: Mapping[str, str] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Refuse parameters out of bounds, and causes without parameters."""
        for name, q in self.parameters.items():
            if not q.low <= q.value <= q.high:
                raise ValueError(
                    f"{name} = {q.value:g} {q.unit} is outside [{q.low:g}, {q.high:g}]; correct "
                    "the value or its bounds"
                )
            if q.log and q.low <= 0.0:
                raise ValueError(
                    f"{name} is fitted on a logarithmic scale, and may be {q.low:g} {q.unit}; "
                    "give a lower bound above 0"
                )
        for part in ("inputs", "outputs", "causes"):
            if not getattr(self, part):
                raise ValueError(f"{self.name} has no {part}; give at least one")
        for cause in self.causes:
            for term in (t for form in cause.forms for t in form.terms):
                known = [n for n, q in self.parameters.items() if q.effect]
                if term.name not in known:
                    raise ValueError(
                        f"{cause.name} has the term {term.name!r}, which is no parameter with "
                        f"effect=True{near(term.name, known)}"
                    )

    @property
    def kind(self) -> "SimulatorKind":
        """The plant before a recording is given."""
        return SimulatorKind(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of a column."""
        return tuple(self.parameters)

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name [SI]."""
        return {name: q.value for name, q in self.parameters.items()}

    def replace(self, values: Values) -> Self:
        """Return the simulation with other values of parameters."""
        for name in values:
            if name not in self.parameters:
                raise ValueError(f"no parameter named {name!r}{near(name, self.names)}")
        changed = {n: replace(self.parameters[n], value=float(v)) for n, v in values.items()}
        return replace(self, parameters={**self.parameters, **changed})

    def run(self, inputs: Mapping[str, Array], period: float) -> dict[str, Array]:
        """Return the outputs under some inputs, from rest; ValueError for a wrong shape."""
        return self.run_with(self.values, inputs, period)

    def run_with(
        self, values: Values, inputs: Mapping[str, Array], period: float
    ) -> dict[str, Array]:
        """Return the outputs with other values of all parameters."""
        n = len(next(iter(inputs.values())))
        given = self.simulate(dict(values), dict(inputs), period)
        made = {}
        for channel in self.outputs:
            if channel.name not in given:
                raise ValueError(
                    f"{self.name} returns no output {channel.name!r}{near(channel.name, given)}"
                )
            made[channel.name] = np.asarray(given[channel.name], np.float64)
            if made[channel.name].shape != (n,):
                raise ValueError(
                    f"{self.name} returns {channel.name} of shape {made[channel.name].shape} for "
                    f"{n} samples; return one value a sample"
                )
        return made

    def record(
        self,
        time: Any,
        inputs: Mapping[str, Any],
        outputs: Mapping[str, Any],
        *,
        segment: Sequence[str] | None = None,
        source: str = "arrays",
    ) -> Recording:
        """Return a recording of the plant (:meth:`Recording.of_channels`)."""
        channels = (*self.inputs, *self.outputs)
        given = {"segment": segment, "source": source}
        return Recording.of_channels(time, inputs, outputs, channels=channels, **given)  # type: ignore[arg-type]

    def digest(self) -> str:
        """Return a hash of name and parameters, 16 hexadecimal digits."""
        text = json.dumps([self.name, self.values], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def to_yaml(self, path: str | Path) -> None:
        """Write the parameters with units and origins."""
        rows = {
            name: {
                "value": q.value,
                "unit": q.unit,
                "source": self.provenance.get(name, "given, not fitted"),
            }
            for name, q in self.parameters.items()
        }
        text = yaml.safe_dump({"plant": self.name, "parameters": rows}, sort_keys=False)
        write_text(Path(path), text)


@dataclass(frozen=True)
class BoundSimulator(UsualStart):
    """Simulation with the inputs of a recording."""

    plant: Simulator
    period: float
    inputs: Mapping[str, Array]
    starts: tuple[int, ...]  # first sample of each run

    checks = 0

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(c.name for c in self.plant.outputs)

    @property
    def column(self) -> Array:
        """Parameters, shape (p,)."""
        return np.array(list(self.plant.values.values()))

    def simulate(self, columns: Array) -> Array:
        """Return readings for parameter columns (n, p), shape (channels, T, n)."""
        n = len(next(iter(self.inputs.values())))
        ends = (*self.starts[1:], n)
        made = np.empty((len(columns), len(self.channels), n))
        for column, outputs in zip(columns, made, strict=True):
            values = dict(zip(self.plant.names, map(float, column), strict=True))
            for a, b in zip(self.starts, ends, strict=True):
                part = {name: v[a:b] for name, v in self.inputs.items()}
                found = self.plant.run_with(values, part, self.period)
                outputs[:, a:b] = [found[c] for c in self.channels]
        return made.transpose(1, 2, 0)

    def tie(self, columns: Array) -> None:
        """Complete columns: none needs it."""

    def violations(self, columns: Array) -> Array:
        """Return by how much columns are not physical: bounds suffice."""
        return np.zeros((len(columns), 0))

    def declared(self, name: str) -> Declaration:
        """Return the declaration of a parameter."""
        q = self.plant.parameters[name]
        return Declaration(q.unit, q.low, q.high, "assumed", "", q.value if q.effect else None)

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter; ``changes`` override its declaration."""
        q = self.plant.parameters[name]
        made = {"low": q.low, "high": q.high, "scale": q.step, "log": q.log, "start": q.value}
        return Free(name, self.plant.names.index(name), **{**made, **changes})

    def base(self) -> tuple[Free, ...]:
        """Return the parameters that belong to no cause."""
        return tuple(self.free(n) for n, q in self.plant.parameters.items() if not q.effect)

    def unmet_needs(self, recording: Recording, sheet: Rig) -> dict[str, str]:
        """Return the needs that a recording does not meet: there are none."""
        return {}

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the motion over the first input."""
        first = self.plant.inputs[0]
        drive = self.inputs[first.name]
        size = FULL / max(float(np.max(np.abs(drive))), 1e-300)
        return Signals(
            first.name,
            drive * size,
            np.array([outputs[0], drive * size]),
            np.zeros(len(drive)),
            label=f"{first.name.replace('_', ' ')} [{first.unit}]",
            scale=size * first.scale,
        )

    def plant_of(self, column: Array) -> Simulator:
        """Return the simulation with the parameters of a column."""
        return self.plant.replace(dict(zip(self.plant.names, column, strict=True)))

    def identified(self, plant: Any, frees: Iterable[Free], source: str) -> Simulator:
        """Return a simulation with the origin of its fitted parameters."""
        found: Simulator = replace(plant, provenance={f.name: source for f in frees})
        return found


class SimulatorKind:
    """Any simulation."""

    weighed = False
    loop, loop_reason = None, "controllers of a simulation are not compared"

    def __init__(self, plant: Simulator) -> None:
        self.plant, self.name, self.catalogue = plant, plant.name, plant.causes

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Outputs, whose noise is at least a millionth of the unit of reports."""
        return tuple(Output(c.name, 1e-3 * c.scale) for c in self.plant.outputs)

    def start(self, sheet: Rig) -> Simulator:
        """Return the simulation with the known parameters of a rig."""
        return self.plant.replace(sheet.parameters)

    def causes(self, asked: Sequence[Cause]) -> tuple[Cause, ...]:
        """Return the requested causes."""
        return tuple(asked)

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundSimulator:
        """Return the simulation with the inputs of a recording."""
        lacking = [c.name for c in plant.inputs if c.name not in recording.inputs]
        if lacking:
            raise ValueError(f"the recording lacks the input {lacking[0]!r} of {plant.name}")
        starts = tuple(np.flatnonzero(recording.restart).tolist())
        return BoundSimulator(plant, recording.period, recording.inputs, starts)

    def plans(self, recording: Recording, sheet: Rig, family: Any) -> tuple[Experiment, ...]:
        """Return the experiments that a rig can do: none are known."""
        return ()

    def audit(self, recording: Recording, sheet: Rig) -> Audit:
        """Return the findings on a recording before its diagnosis."""
        return audit_channels(recording, sheet, self.plant.names)

    def compared(self, measured: Array, family: Any, restart: Flags) -> Array:
        """Return readings (channels, T) that are compared with a simulation: all."""
        return measured

    def calibrate(
        self,
        family: Any,
        measured: Array,
        noise: Array,
        blocks: Blocks,
        time: Array,
        shapes: Array,
    ) -> Calibration:
        """Fit all parameters that belong to no cause."""
        return calibrate_compiled(family, measured, noise, blocks, time, shapes)
