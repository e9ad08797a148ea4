"""Hysteresis model added by one file, for plants, environments, files and batches."""

import importlib.util
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401  registers the environments
from pam_envs.hysteresis import protocol
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.plant import SingleMuscle

TOY = '''
    """A backlash with a linear part in parallel, the toy of this test."""

    from dataclasses import dataclass
    from typing import Any, ClassVar

    import numpy as np

    from pam_envs.hysteresis.protocol import HysteresisModel, Kernels, padded, register
    from pam_envs.kernels.build import kernel


    @kernel
    def backlash(
        x, y, rows, fixed, counts, table, elements, at, model, count, member, first, last
    ):
        """Advance the gap of every lane."""
        gap, slope, share, state = fixed[model + 1], fixed[model], fixed[model + 2], rows[at]
        for j in range(first, last):
            state[j] = max(x[j] - gap[j], min(x[j] + gap[j], state[j]))
            y[j] = slope[j] * (x[j] + share[j] * (state[j] - x[j]))


    @register
    @dataclass(frozen=True)
    class Backlash(HysteresisModel):
        """Half a line and half a backlash of one gap."""

        kind: ClassVar[str] = "toy"
        kernels: ClassVar[Kernels] = Kernels(backlash)
        state_rows: ClassVar[int] = 1

        gap: float
        slope: float = 1.0
        share: float = 0.5

        @property
        def largest_lag(self):
            return self.share * self.gap

        def numbers(self, full=None):
            return padded([self.slope, self.gap, self.share])

        def scaled(self, width, slope=None):
            return Backlash(self.gap, self.slope, width * self.share)

        def initial_state(self, batch_shape=()):
            return np.zeros((*batch_shape, 1))

        def step(self, x, state):
            x = np.asarray(x, float)
            w = np.maximum(x - self.gap, np.minimum(x + self.gap, state[..., 0]))
            return self.slope * (x + self.share * (w - x)), w[..., None]

        def inverse_step(self, y, state):
            y, w, a = np.asarray(y, float) / self.slope, state[..., 0], self.share
            inside = (y - a * w) / (1.0 - a)
            x = np.clip(inside, w - self.gap, w + self.gap)
            x = np.where(inside > w + self.gap, y + a * self.gap, x)
            x = np.where(inside < w - self.gap, y - a * self.gap, x)
            return x, self.step(x, state)[1]

        @classmethod
        def resembling(cls, reference, low, high, levels, start):
            slope = reference.total_slope
            return cls(0.02 * high, slope)
'''
IDS = {
    "PAM/MusclePositioning-v0": SingleMuscle.mas10,
    "PAM/KneeTension-v0": KneeOrthosis.no_load,
    "PAM/AntagonisticJoint-v0": AntagonisticJoint.paper,
    "PAM/ElbowOrthosis-v0": ElbowOrthosis.paper,
}


@pytest.fixture(scope="module", autouse=True)
def toy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Import the model from one file in a temporary folder; remove it afterwards."""
    file = tmp_path_factory.mktemp("models") / "backlash.py"
    file.write_text(textwrap.dedent(TOY))
    spec = importlib.util.spec_from_file_location("toy_backlash", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del protocol.MODELS["toy"]


def outputs(env: Any, steps: int = 40) -> list[float]:
    """Return the signals of an episode under a fixed, cyclic action."""
    observation, _ = env.reset(seed=3)
    found = [*observation]
    for k in range(steps):
        action = np.full(env.action_space.shape, np.sin(0.3 * k), np.float32)
        found += [*env.step(action)[0]]
    return found


def test_registry_names_the_model_between_the_others() -> None:
    assert protocol.kinds() == ("maxwell_slip", "preisach", "toy", "none")


@pytest.mark.parametrize("name", IDS)
@pytest.mark.skipif(COMPILED, reason="one environment is compiled in the next test")
def test_environment_takes_the_model_by_name_by_file_and_in_a_batch(
    name: str, tmp_path: Path
) -> None:
    made = gym.make(name, hysteresis="toy")
    alone = outputs(made)
    assert alone != outputs(gym.make(name, hysteresis="none"))
    file = tmp_path / "plant.yaml"
    made.unwrapped.plant.to_yaml(file)  # type: ignore[attr-defined]
    assert "kind: toy" in file.read_text()
    assert outputs(gym.make(name, plant=str(file))) == alone
    check_batch(name, alone)


@pytest.mark.skipif(not COMPILED, reason="needs the compiler")
def test_compiled_batch_with_the_model_equals_the_single_environment() -> None:
    name = "PAM/MusclePositioning-v0"
    check_batch(name, outputs(gym.make(name, hysteresis="toy")))


def check_batch(name: str, alone: list[float]) -> None:
    """Compare the first row of a batch with the environment alone."""
    batch = gym.make_vec(
        name, num_envs=3, vectorization_mode="vector_entry_point", hysteresis="toy"
    )
    observations, _ = batch.reset(seed=3)
    found = [*observations[0]]
    for k in range(40):
        action = np.full(batch.action_space.shape, np.sin(0.3 * k), np.float32)
        found += [*batch.step(action)[0][0]]
    assert found == alone


def test_row_wise_inverse_cancels_the_model(toy: Any) -> None:
    rows = toy.Backlash(0.3).rows()
    state = rows.initial(2)
    for x in ([0.0, 0.5], [1.0, -0.8], [0.2, 0.1]):
        y, after = rows.forward(np.array(x), state)
        np.testing.assert_allclose(rows.inverse(y, state), x, atol=1e-12)
        state = after


def test_unknown_kind_names_the_known_ones() -> None:
    with pytest.raises(ValueError, match="'toy' or 'none'"):
        SingleMuscle.mas10("dahl")


@pytest.mark.parametrize("make", IDS.values())
def test_member_of_an_ensemble_may_have_its_own_operator(make: Any, toy: Any) -> None:
    plant = make("toy")
    other = plant.replace({"hysteresis.operator": plant.hysteresis.operator.scaled(0.5)})
    columns = plant.parameter_rows(), other.parameter_rows()
    assert (columns[0] != columns[1]).sum() >= 1
