"""Whatever decides a verdict belongs to a version of the rule: a change needs a new one."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import json
import pkgutil
from typing import Any

import pytest

from pam_envs.diagnosis import causes
from pam_envs.diagnosis.decide.rule import Rule

MODULES = (
    *("calibrate", "diagnosis", "experiment", "first_guess", "fitting", "held_out", "isolability"),
    *("noise", "plans", "repeats", "search", "seeds", "structure", "testable", "tolerance"),
    "verdict",
)
DIGESTS = {"2": "8a4e58bb4db22873"}
"""Of every version of the rule that was ever reported."""


def plain(value: Any) -> Any:
    """Return numbers and texts, also within tuples and mappings; None for all else."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (tuple, list)):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    return None


def numbers_of(module: Any) -> dict[str, Any]:
    """Return the values of a module's names in capitals."""
    return {key: plain(v) for key, v in sorted(vars(module).items()) if key.strip("_").isupper()}


def constants() -> dict[str, Any]:
    """Return the named numbers of the deciding modules, and what each cause may be."""
    made: dict[str, Any] = {}
    for name in MODULES:
        module = importlib.import_module(f"pam_envs.diagnosis.{name}")
        made[name] = numbers_of(module)
    for info in pkgutil.iter_modules(causes.__path__):
        made[info.name] = numbers_of(importlib.import_module(f"{causes.__name__}.{info.name}"))
    for cause in causes.catalogue():
        forms = [(f.name, f.looks, *map(dataclasses.astuple, f.terms)) for f in cause.forms]
        made[f"cause {cause.name}"] = plain((forms, cause.contains, cause.needs, cause.once))
    return made


def digest(rule: Rule) -> str:
    numbers = {k: v for k, v in dataclasses.asdict(rule).items() if k != "version"}
    text = json.dumps([numbers, constants()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def test_a_changed_constant_is_a_new_version() -> None:
    rule = Rule()
    assert rule.version in DIGESTS, "give the digest of the new version"
    assert digest(rule) == DIGESTS[rule.version], (
        "a constant that decides was changed: give the rule a new version, and keep the old digest"
    )


@pytest.mark.parametrize("field", [f.name for f in dataclasses.fields(Rule) if f.name != "version"])
def test_every_number_of_the_rule_counts(field: str) -> None:
    rule = Rule()
    other = dataclasses.replace(rule, **{field: getattr(rule, field) + 1})
    assert digest(other) != digest(rule)
