"""Plants as YAML: ``schema: 1``, SI values with unit, provenance and source.

    schema: 1
    family: single_muscle
    substeps: 4
    parameters:
      muscle.area: {value: 8.7e-4, unit: m2, provenance: identified, source: "..."}
    hysteresis: {kind: maxwell_slip, linear: 0.2, thresholds: [1.0e4, ...], weights: [0.1, ...]}
    ensemble: [{muscle.area: 8.8e-4, hysteresis: {...}}, ...]
    notes: {...}

Everything but ``schema`` and ``family`` may be missing. Notes are free text and not hashed. For a
family with several variants, the file also contains the choices (``mounting: leg``).
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import yaml

from pam_envs import yaml_file
from pam_envs.files import write_text
from pam_envs.hysteresis import protocol
from pam_envs.parameters import PROVENANCES, declarations
from pam_envs.wording import shown

if TYPE_CHECKING:
    from pam_envs.plants.core.plant import Plant

P = TypeVar("P", bound="Plant")
KEYS = ("schema", "family", "substeps", "parameters", "hysteresis", "ensemble", "notes")
ENTRY_KEYS = ("value", "unit", "provenance", "source")


def record(plant: Plant) -> dict[str, Any]:
    """Return a plant as plain data, in the layout of the file."""
    parameters = {}
    absent = _absent(plant)
    parts = {component: getattr(plant, component) for component in plant.components}
    for component, part in parts.items():
        for name, declared in declarations(part).items():
            key = f"{component}.{name}"
            if key in absent:
                continue
            kind, source = plant.provenance.get(key, (declared.provenance, declared.source))
            parameters[key] = {
                "value": float(getattr(part, name)),
                "unit": declared.unit,
                "provenance": kind,
                "source": source,
            }
    ensemble = []
    for member in plant.ensemble:
        values: dict[str, Any] = {
            k: float(v) for k, v in member.items() if k != "hysteresis.operator"
        }
        if "hysteresis.operator" in member:
            values["hysteresis"] = protocol.record(member["hysteresis.operator"])
        ensemble.append(values)
    return {
        "schema": 1,
        "family": plant.family,
        **{choice: getattr(plant, choice) for choice in plant.choices},
        "substeps": plant.substeps,
        "parameters": parameters,
        "hysteresis": protocol.record(parts["hysteresis"].operator),
        "ensemble": ensemble,
    }


def _absent(plant: Plant) -> set[str]:
    """Return the parameters of effects that are off, which a file need not name."""
    absent = set()
    for names in plant.effects:
        amounts = [n for n in names if plant.declaration(n).neutral is not None]
        if all(plant.value(n) == plant.declaration(n).neutral for n in amounts):
            absent |= set(names)
    return absent


def digest(plant: Plant) -> str:
    """Return a hash over the canonical values (not provenance, sources or notes)."""

    def exact(value: Any) -> Any:
        if isinstance(value, float):
            return value.hex()
        if isinstance(value, Mapping):
            return {k: exact(v) for k, v in value.items()}
        if isinstance(value, list):
            return [exact(v) for v in value]
        return value

    data = record(plant)
    data["parameters"] = {k: v["value"] for k, v in data["parameters"].items()}
    text = json.dumps(exact(data), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def write(plant: Plant, path: Path, notes: Mapping[str, Any] | None = None) -> None:
    """Write a plant file atomically."""
    data = record(plant)
    if notes:
        data["notes"] = dict(notes)
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)


def read(cls: type[P], path: Path) -> P:
    """Read a plant file; every error names the file, the key and the remedy."""
    data = yaml_file.read(path, "plant file")
    where = f"plant file {path}"
    with yaml_file.naming(where):
        return _checked(cls, data, where)


def _checked(cls: type[P], data: Any, where: str) -> P:
    if not isinstance(data, Mapping):
        raise ValueError(f"{where}: must hold a mapping with the keys {', '.join(KEYS)}")
    keys = (*KEYS, *cls.choices)
    unknown = [str(k) for k in data if k not in keys]
    if unknown:
        rig = "; this looks like a rig file" if "plant" in data else ""
        raise ValueError(f"{where}: unknown key {shown(unknown[0])}{rig}; known: {', '.join(keys)}")
    if data.get("schema") != 1:
        raise ValueError(
            f"{where}: schema is {shown(data.get('schema'))}; this version reads schema 1"
        )
    if data.get("family") != cls.family:
        raise ValueError(f"{where}: family is {shown(data.get('family'))}, expected {cls.family!r}")
    return _build(cls, data, where)


def _build(cls: type[P], data: Mapping[str, Any], where: str) -> P:
    values: dict[str, Any] = {}
    provenance: dict[str, tuple[str, str]] = {}
    given = data.get("parameters") or {}
    known = {
        f"{c}.{name}": d
        for c in cls.components
        for name, d in declarations(getattr(cls(), c)).items()
    }
    if not isinstance(given, Mapping):
        raise ValueError(f"{where}: parameters must be a mapping, got {shown(given)}")
    for name, entry in given.items():
        if name not in known:
            raise ValueError(
                f"{where}: unknown parameter {shown(name)}; known parameters: {', '.join(known)}"
            )
        values[name] = _entry(name, entry, known[name].unit, where)
        if isinstance(entry, Mapping) and "provenance" in entry:
            provenance[name] = (str(entry["provenance"]), str(entry.get("source", "")))
    if "hysteresis" in data:
        values["hysteresis.operator"] = protocol.read(data["hysteresis"], where)
    ensemble = []
    for i, member in enumerate(data.get("ensemble") or []):
        place = f"{where}: ensemble[{i}]"
        if not isinstance(member, Mapping):
            raise ValueError(f"{place} must be a mapping from parameter to value")
        other: dict[str, Any] = {
            k: _entry(k, v, "", place) for k, v in member.items() if k != "hysteresis"
        }
        if "hysteresis" in member:
            other["hysteresis.operator"] = protocol.read(member["hysteresis"], place)
        ensemble.append(other)
    substeps = data.get("substeps", 4)
    choices: Any = {choice: data[choice] for choice in cls.choices if choice in data}
    plant = cls(substeps=substeps, provenance=provenance).replace(values)
    made = dataclasses.replace(plant, ensemble=tuple(ensemble), **choices)
    made.members()  # every member must be a valid plant
    return made


def _entry(name: str, entry: Any, unit: str, where: str) -> float:
    value = entry
    if isinstance(entry, Mapping):
        unknown = [str(k) for k in entry if k not in ENTRY_KEYS]
        if unknown:
            raise ValueError(
                f"{where}: {name} has an unknown key {shown(unknown[0])}; known: "
                + ", ".join(ENTRY_KEYS)
            )
        if "value" not in entry:
            raise ValueError(f"{where}: {name} has no value; give value: in {unit}")
        value = entry["value"]
        if unit and entry.get("unit", unit) != unit:
            raise ValueError(
                f"{where}: {name} is given in {shown(entry['unit'])}, expected {unit!r} (SI); "
                "convert it"
            )
        if "provenance" in entry and entry["provenance"] not in PROVENANCES:
            raise ValueError(
                f"{where}: {name} has provenance {shown(entry['provenance'])}; "
                f"choose one of {', '.join(PROVENANCES)}"
            )
    number = yaml_file.number(value)
    if number is None:
        raise ValueError(f"{where}: {name} must be a number in {unit or 'SI'}, got {shown(value)}")
    return number
