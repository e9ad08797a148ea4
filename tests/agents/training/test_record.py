"""Cost of a training."""

from __future__ import annotations

import json

from short_runs import ID, tiny

from agents.settings import presets as configs
from agents.training import record

SPENT = {"wall": 2.0, "cpu": 1.0}


def test_steps_are_those_done() -> None:
    done = record.cost(tiny(), 3, "x", SPENT, 1_030)
    assert (done["steps"], done["frames_per_second"]) == (1_030, 515)


def test_settings_by_hand_have_no_number_of_trials() -> None:
    by_hand = configs.from_mapping({"env": ID})
    assert json.loads(json.dumps(record.cost(by_hand, 3, "x", SPENT, 7)))["tuning_trials"] is None
    searched = configs.changed(by_hand, ["search.trials=40"])
    assert record.cost(searched, 3, "x", SPENT, 7)["tuning_trials"] == 40
