"""What a training cost, in numbers that are true."""

from __future__ import annotations

import json

from short_runs import ID, tiny

from agents.settings import presets as configs
from agents.training import record

SPENT = {"wall": 2.0, "cpu": 1.0}


def test_steps_are_those_that_were_done() -> None:
    done = record.training(tiny(), 3, "x", SPENT, steps=1_030)
    assert (done["steps"], done["frames_per_second"]) == (1_030, 515)


def test_settings_by_hand_were_not_tried_zero_times() -> None:
    by_hand = configs.from_mapping({"env": ID})
    assert json.loads(json.dumps(record.training(by_hand, 3, "x", SPENT)))["tuning_trials"] is None
    searched = configs.changed(by_hand, ["search.trials=40"])
    assert record.training(searched, 3, "x", SPENT)["tuning_trials"] == 40
