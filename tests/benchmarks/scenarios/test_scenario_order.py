"""A scenario file and its record in a row are the same scenarios in the same order."""

from __future__ import annotations

import json

import pytest

from benchmarks.scenarios.scenario import ScenarioSet, available


@pytest.mark.parametrize("name", sorted(available()))
def test_record_gives_the_scenarios_of_its_file(name: str) -> None:
    made = available()[name]
    content = json.loads(json.dumps(made.content, sort_keys=True))
    again = ScenarioSet(content)
    assert again.digest == made.digest
    assert again.scenarios() == made.scenarios()
    assert len({s.name for s in made.scenarios()}) == len(made.scenarios()) > 1
