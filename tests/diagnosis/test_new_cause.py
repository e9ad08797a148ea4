"""Third-party cause: one file, and a second one for its hidden counterpart."""

import runpy

import numpy as np
import pytest

from benchmarks.diagnosis.cases import recording_of, sheet_of
from pam_envs.diagnosis import diagnose
from pam_envs.diagnosis.causes import by_name, causes_in
from tests.diagnosis import hidden
from tests.diagnosis.conftest import needs_kernels

CAUSE = '''
"""Clogged silencer: the muscle exhausts more slowly than it fills."""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="clogged_silencer",
    title="a clogged silencer",
    forms=(Form("lag", (Term("regulator.exhaust_ratio", (1.2,), log=True),)),),
    needs=("exhaust",),
)
'''
HIDDEN = '''
"""A silencer through which less air escapes at low absolute pressure."""

from tests.diagnosis.hidden.effect import Kind

KIND = Kind("exhaust", 0.08)
'''
RIVALS = ("creep", "dead_time", "sensor_bias", "slew_limit", "temperature")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "causes").mkdir()
    (tmp_path / "causes/clogged_silencer.py").write_text(CAUSE)
    (tmp_path / "hidden.py").write_text(HIDDEN)
    return tmp_path


@needs_kernels
def test_cause_from_a_folder_is_found_in_the_rig_that_hides_its_counterpart(folder):
    random = np.random.default_rng(8)
    base, campaign = hidden.draw_base(random), hidden.campaign_standard(2)
    effect = runpy.run_path(str(folder / "hidden.py"))["KIND"].effect("clogged_silencer", random)
    sheet = sheet_of(base, campaign)
    columns = hidden.make_recording(base, [(effect, 4.0)], campaign, noise_seed=4)
    recording = recording_of(columns, sheet, "toy")
    causes = [*causes_in(folder / "causes"), *map(by_name, RIVALS)]
    found = diagnose(recording, rig=sheet, causes=causes, progress=False, closed_loop=False)
    assert (found.verdict, found.causes) == ("named", ("clogged_silencer",))
    assert found.plant.regulator.exhaust_ratio > 1.0


def test_folder_of_causes_is_checked(folder):
    (cause,) = causes_in(folder / "causes")
    assert cause.name == "clogged_silencer"
    (folder / "causes/notes.py").write_text("TEXT = 'no cause'\n")
    with pytest.raises(ValueError, match=r"notes\.py declares no cause"):
        causes_in(folder / "causes")
    (folder / "empty").mkdir()
    with pytest.raises(ValueError, match="holds no Python file"):
        causes_in(folder / "empty")
