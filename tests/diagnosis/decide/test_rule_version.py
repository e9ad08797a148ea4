"""Recorded numbers and decisions of each version of the rule."""

import json
from typing import Any

import pytest

from pam_envs.diagnosis.decide.rule import Rule
from tests.diagnosis.decide import rule_record as recorded

RULE = Rule()
ADVICE = (
    "a number or a decision changed: give the rule a new version and record it with "
    "python -m tests.diagnosis.decide.rule_record; keep the old record"
)


@pytest.fixture(scope="module")
def known():
    path = recorded.path_of(RULE.version)
    assert path.is_file(), f"no record of version {RULE.version}: {ADVICE}"
    return dict(json.loads(path.read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def present():
    return recorded.record(RULE)


def test_numbers_of_the_rule_belong_to_its_version(known, present):
    assert present["rule"] == known["rule"], ADVICE


def test_numbers_of_shipped_causes_belong_to_the_version(known, present):
    for name, numbers in known["causes"].items():
        assert present["causes"][name] == numbers, f"{name}: {ADVICE}"


def test_recorded_evidence_gives_the_recorded_verdicts(known, present):
    assert present["judgements"] == known["judgements"], ADVICE
    assert {found["verdict"] for found in known["judgements"].values()} >= {"named", "adequate"}


@pytest.mark.parametrize("part", ["decisions", "noise"])
def test_engine_reproduces_its_recorded_decisions(part, known, present):
    assert_alike(present[part], known[part], part)


def assert_alike(found: Any, expected: Any, where: str) -> None:
    """Compare nested values, numbers within what processors differ by."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), where
        for key, value in expected.items():
            assert_alike(found[key], value, f"{where}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for k, value in enumerate(expected):
            assert_alike(found[k], value, f"{where}[{k}]")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-3, abs=6e-3), f"{where}: {ADVICE}"
    else:
        assert found == expected, f"{where}: {ADVICE}"
