"""Diagnosis of a simulation that is given as a function."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from pam_envs.data.recording.channels import Channel
from pam_envs.diagnosis import Quantity, Simulator, diagnose
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.families.simulator import BoundSimulator

EXAMPLE = Path(__file__).parents[3] / "docs/examples/simulator/dc_motor.py"
LAG = Cause("lag", "a lag", (Form("first order", (Term("lag", (0.1,)),)),))


def example():
    """Return the module of the documentation's example."""
    spec = importlib.util.spec_from_file_location("dc_motor", EXAMPLE)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def amplifier(**changes):
    """Return an amplifier whose output may lag."""

    def simulate(parameters, inputs, period):
        made, state = np.empty(len(inputs["voltage"])), 0.0
        for k, value in enumerate(inputs["voltage"]):
            made[k] = state
            share = 1.0 - np.exp(-period / max(parameters["lag"], 1e-6))
            state += share * (parameters["gain"] * value - state)
        return {"current": made}

    made = {
        "simulate": simulate,
        "parameters": {
            "gain": Quantity(1.0, "A/V", 0.1, 10.0),
            "lag": Quantity(0.0, "s", 0.0, 1.0, effect=True),
        },
        "inputs": (Channel("voltage", unit="V"),),
        "outputs": (Channel("current", unit="A"),),
        "causes": (LAG,),
    }
    return Simulator(**{**made, **changes})


@pytest.mark.parametrize("hidden", ["friction", "dead_time"])
def test_hidden_effect_of_the_example_is_named(hidden):
    found = example().found(hidden)
    assert (found.verdict, found.causes) == ("named", (hidden,))
    truth = example().HIDDEN[hidden][hidden]
    assert found.plant.values[hidden] == pytest.approx(truth, rel=0.1)


def test_example_without_a_hidden_effect_is_adequate_and_writes_its_parameters(tmp_path):
    found = example().found("nothing")
    assert (found.verdict, found.causes) == ("adequate", ())
    assert found.plant.values["gain"] == pytest.approx(36.0, rel=0.02)
    found.write(tmp_path)
    assert "rad/(s2 V)" in (tmp_path / "plant.yaml").read_text()
    assert "voltage [V]" in (tmp_path / "report.html").read_text()


def test_each_run_of_a_recording_begins_at_rest():
    plant = amplifier().replace({"lag": 0.2})
    voltage = np.ones(40)
    family = BoundSimulator(plant, 0.1, {"voltage": voltage}, (0, 25))
    current = family.simulate(family.column[None])[0, :, 0]
    assert current[0] == current[25] == 0.0
    assert current[24] > 0.9
    assert np.array_equal(current[25:], current[:15])


def test_a_declaration_that_contradicts_itself_is_refused():
    with pytest.raises(ValueError, match=r"gain = 20 A/V is outside \[0.1, 10\]"):
        amplifier().replace({"gain": 20.0})
    with pytest.raises(ValueError, match="'lagg', which is no parameter with effect=True"):
        amplifier(causes=(Cause("lag", "a lag", (Form("one", (Term("lagg", (0.1,)),)),)),))
    with pytest.raises(ValueError, match="logarithmic scale"):
        amplifier(parameters={"lag": Quantity(0.1, "s", 0.0, 1.0, effect=True, log=True)})
    with pytest.raises(ValueError, match="no outputs"):
        amplifier(outputs=())


def test_a_function_with_wrong_outputs_is_refused_with_the_name():
    time = 0.02 * np.arange(5000)
    voltage = np.sin(time)
    noise = np.random.default_rng(0).normal(0.0, 1e-3, len(time))
    for simulate, text in (
        (lambda p, u, h: {"curent": u["voltage"]}, "returns no output 'current'"),
        (lambda p, u, h: {"current": u["voltage"][:-1]}, r"of shape \(4999,\) for 5000 samples"),
    ):
        plant = amplifier(simulate=simulate)
        recording = plant.record(time, {"voltage": voltage}, {"current": voltage + noise})
        with pytest.raises(ValueError, match=text):
            diagnose(recording, plant, progress=False)
    lacking = amplifier(inputs=(Channel("voltage"), Channel("heat")))
    with pytest.raises(ValueError, match="lacks the input 'heat'"):
        diagnose(recording, lacking, progress=False)
