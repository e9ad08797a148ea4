"""Cost of a training."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from short_runs import ID, tiny

from agents.settings import presets as configs
from agents.training import record


def cost_of(config: configs.Config, steps: int) -> dict[str, Any]:
    return record.cost(record.Run(config, 3, Path("x")), {"wall": 2.0, "cpu": 1.0}, steps)


def test_record_counts_the_completed_steps() -> None:
    done = cost_of(tiny(), 1_030)
    assert (done["steps"], done["frames_per_second"]) == (1_030, 515)


def test_settings_chosen_by_hand_have_no_number_of_trials() -> None:
    by_hand = configs.from_mapping({"env": ID})
    assert json.loads(json.dumps(cost_of(by_hand, 7)))["tuning_trials"] is None
    searched = configs.changed(by_hand, ["search.trials=40"])
    assert cost_of(searched, 7)["tuning_trials"] == 40
