"""What is exported: the arrays that a kernel reads, and named variables with units in them."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pam_envs.kernels.machine_code import Source, intermediate_of
from pam_envs.wording import package


@dataclass(frozen=True)
class Variable:
    """A named number of a model."""

    name: str
    """As ``muscle.area`` or ``reward/tracking``."""
    unit: str
    block: str
    index: int
    """Block that holds it, and its position there."""
    start: float = 0.0
    low: float | None = None
    high: float | None = None
    text: str = ""
    meant: str = ""
    """Range in SI of an entry that is scaled to -1 .. 1."""

    @property
    def span(self) -> str:
        """Range in words, empty if there is none."""
        if self.low is None:
            return ""
        meant = f" for {self.meant}" if self.meant else ""
        return f"{self.low:g} .. {self.high:g}{meant}"

    @property
    def word(self) -> str:
        """The name as an identifier."""
        return identifier(self.name)


@dataclass(frozen=True)
class Block:
    """An array in the address book of a kernel."""

    name: str
    values: NDArray[Any]
    """Initial values."""
    shape: tuple[int, ...]
    """Shape in the book; memory is kept for ``values`` alone."""
    constant: bool = False


@dataclass(frozen=True)
class Model:
    """An environment, a plant or a controller as one state, kernels and named variables.

    Attributes
    ----------
    title, name : str
        Title for people, and identifier of files and functions.
    period : float
        Control period [s].
    blocks : tuple of Block
        In the order of the address book.
    kernels : mapping
        Source of each kernel, by the suffix of its function.
    inputs, outputs, parameters : tuple of Variable
        Outputs in groups: their names begin with the group and a dot.
    kind : {"environment", "plant", "controller"}
        An environment has seeds and episodes. Inputs of a controller are an observation, its
        output is an action.
    agreement : str
        How its outputs compare with those of the package, for the documentation.
    facts : mapping
        Further lines for the documentation.
    """

    title: str
    name: str
    period: float
    blocks: tuple[Block, ...]
    kernels: Mapping[str, Source]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    kind: Literal["environment", "plant", "controller"]
    facts: Mapping[str, str] = field(default_factory=dict)
    agreement: str = "equal to those of pam-envs to the last bit"

    @property
    def episodic(self) -> bool:
        """Whether it has seeds and episodes."""
        return self.kind == "environment"

    @property
    def prefix(self) -> str:
        """Prefix of functions and types."""
        return f"pam_{self.name}"

    def block(self, name: str) -> Block:
        """Return a block by name."""
        return next(block for block in self.blocks if block.name == name)

    def group(self, prefix: str) -> list[Variable]:
        """Return the outputs of a group."""
        return [v for v in self.outputs if v.name.startswith(f"{prefix}.")]

    @cached_property
    def intermediates(self) -> tuple[str, ...]:
        """LLVM IR of the kernels, whose public functions are ``PREFIX_SUFFIX``."""
        return tuple(
            intermediate_of(source).replace("@pam_kernel(", f"@{self.prefix}_{suffix}(")
            for suffix, source in self.kernels.items()
        )

    @cached_property
    def digest(self) -> str:
        """Digest of IR, data and variables: equal digests compute equal bits."""
        found = hashlib.sha256()
        for text in self.intermediates:
            found.update(text.encode())
        for block in self.blocks:
            found.update(f"{block.name}{block.values.dtype}{block.shape}".encode())
            found.update(np.ascontiguousarray(block.values).tobytes())
        for variable in (*self.inputs, *self.outputs, *self.parameters):
            found.update(repr(variable).encode())
        return found.hexdigest()

    @property
    def lines(self) -> list[str]:
        """Facts for the documentation."""
        facts = {
            **self.facts,
            "control period": f"{self.period:g} s",
            "digest": self.digest,
            "made by": package(),
        }
        return [f"{name}: {text}" for name, text in facts.items()]


def signal_variables(signals: Any, block: str, prefix: str = "") -> list[Variable]:
    """Return the entries of an observation or action in a block, in their order.

    An entry that is scaled to [-1, 1] is a pure number.
    """
    found = []
    for s in signals:
        unit, low, high, meant = str(s.unit), s.low, s.high, ""
        if s.normalized:
            meant = f"{low:g} .. {high:g}{'' if unit == '1' else f' {unit}'}"
            unit, low, high = "1", -1.0, 1.0
        name = f"{prefix}{s.name}"
        found.append(Variable(name, unit, block, s.index, 0.0, low, high, meant=meant))
    return found


def identifier(name: str) -> str:
    """Return a name as an identifier in lower case."""
    return re.sub(r"\W+", "_", name).strip("_").lower()


def snake(name: str) -> str:
    """Return a name in camel case, as ``KneeWalk-v0``, as an identifier."""
    return identifier(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name.rpartition("-v")[0] or name))


def parameters_of(plant: Any, without: Sequence[str], block: str, first: int) -> list[Variable]:
    """Return the parameters of a plant that have an effect, except some.

    ``first`` is the index of the first named parameter in ``block``. Parameters of effects that
    are off are left out: the kernels of a plant without effects do not read them. So are those that
    the plant refuses to change, because they act on another variant.
    """
    from pam_envs.parameters import declarations
    from pam_envs.plants.core.plant import UnstableParameters
    from pam_envs.plants.core.plant_file import record

    def accepted(name: str, value: float) -> bool:
        try:
            plant.replace({name: value})
        except UnstableParameters:
            return True
        except ValueError:
            return False
        return True

    off = set() if plant.extended else {*plant.names} - {*record(plant)["parameters"]}
    found = []
    for k, name in enumerate(plant.names):
        if name in without or name in off or name in plant.inert:
            continue
        component, _, entry = name.partition(".")
        declared = declarations(getattr(plant, component))[entry]
        value = plant.value(name)
        nearby = value + 0.01 * ((declared.high if value < declared.high else declared.low) - value)
        if not accepted(name, nearby):
            continue
        text = declared.source
        found.append(
            Variable(
                name, declared.unit, block, first + k, value, declared.low, declared.high, text
            )
        )
    return found
