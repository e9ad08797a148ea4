"""Policy files: agreement with torch, rows, signals, and refusal of harmful files."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import pickle
import sys
import zipfile
from base64 import b64encode
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cloudpickle
import gymnasium as gym
import numpy as np
import onnx
import pytest
import yaml
from onnx import TensorProto, helper
from short_runs import ID, tiny
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy

from agents.__main__ import main
from agents.export.export import export_policy
from agents.policies import catalogue
from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import CARD, MOST_BYTES, PolicyFileError, finished, write_policy
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training import checkpoint
from agents.training.record import CHECKPOINT, Run
from agents.training.train import saved_run
from agents.vec_envs.batch import make_batch_vec_env
from pam_envs.parameters import Signals

MODELS = ("ppo", "normalized_ppo", "sac")


def observations(number: int) -> np.ndarray:
    n = len(gym.make(ID).unwrapped.signals)
    return np.random.default_rng(1).uniform(-1, 1, (number, n)).astype(np.float32)


@pytest.mark.parametrize("name", MODELS)
def test_exported_action_equals_that_of_torch(name: str, request: pytest.FixtureRequest) -> None:
    model, folder = request.getfixturevalue(name)
    policy = OnnxPolicy.load(folder / "policy.onnx")
    seen = observations(500)
    normaliser = model.get_vec_normalize_env()
    given = normaliser.normalize_obs(seen) if normaliser else seen
    expected, _ = model.predict(given, deterministic=True)
    action, _ = policy.predict(seen)
    assert action.dtype == np.float32
    assert np.abs(action - expected).max() <= 1e-6
    assert np.ptp(expected) > 1e-3


def test_normaliser_is_part_of_the_file(normalized_ppo: tuple[Any, Path]) -> None:
    model, folder = normalized_ppo
    seen = observations(50)
    action, _ = OnnxPolicy.load(folder / "policy.onnx").predict(seen)
    assert np.abs(action - model.predict(seen)[0]).max() > 1e-3


@pytest.mark.parametrize("name", MODELS)
def test_action_of_a_row_is_independent_of_its_batch(
    name: str, request: pytest.FixtureRequest
) -> None:
    policy = OnnxPolicy.load(request.getfixturevalue(name)[1] / "policy.onnx")
    seen = observations(256)
    whole, _ = policy.predict(seen)
    alone = np.array([policy.predict(row)[0] for row in seen])
    assert np.array_equal(whole, alone)
    for size in (2, 3, 7, 64, 65):
        parts = [policy.predict(seen[i : i + size])[0] for i in range(0, 256, size)]
        assert np.array_equal(np.concatenate(parts), whole)


def test_actions_are_clipped_to_the_range(ppo: tuple[Any, Path]) -> None:
    policy = OnnxPolicy.load(ppo[1] / "policy.onnx")
    action, _ = policy.predict(1e6 * observations(200))
    assert np.abs(action).max() == 1.0
    assert set(np.sign(action).ravel()) == {-1.0, 1.0}


def test_predict_has_the_controllers_interface(ppo: tuple[Any, Path]) -> None:
    policy = OnnxPolicy.load(ppo[1] / "policy.onnx")
    seen = observations(4)
    single, state = policy.predict(seen[0])
    assert single.shape == (1,)
    assert state is None
    batch, _ = policy.predict(seen, None, np.ones(4, bool), deterministic=True)
    assert batch.shape == (4, 1)
    with pytest.raises(ValueError, match=r"shape \(3,\).*contraction"):
        policy.predict(np.zeros(3))
    env = make_batch_vec_env(ID, 4, episode_seconds=0.2)
    mean, _ = evaluate_policy(policy, env, n_eval_episodes=4, warn=False)
    assert np.isfinite(mean)


def test_equal_weights_give_equal_bytes(ppo: tuple[Any, Path], tmp_path: Path) -> None:
    for name in ("a.onnx", "b.onnx"):
        export_policy(ppo[0], tmp_path / name, {"seed": 3})
    first, second = ((tmp_path / n).read_bytes() for n in ("a.onnx", "b.onnx"))
    assert first == second
    assert finished(tmp_path / "a.onnx") == OnnxPolicy.load(tmp_path / "a.onnx").card


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"preview": 3}, "trained with contraction.*env_kwargs"),
        ({"preview_stride": 2}, "reference_1 had ahead = 0.04"),
        ({"normalize": False}, "contraction had normalized = True"),
        ({"reward": {"highest_contraction": 0.018}}, "contraction had high = 0.02"),
    ],
)
def test_environment_with_other_signals_is_refused(
    arguments: dict[str, Any], message: str, ppo: tuple[Any, Path]
) -> None:
    env = gym.make(ID, **arguments).unwrapped
    with pytest.raises(PolicyFileError, match=message):
        OnnxPolicy.load(ppo[1] / "policy.onnx", env.signals, env.action_signals)


def test_environment_with_another_action_is_refused(ppo: tuple[Any, Path]) -> None:
    env = gym.make(ID).unwrapped
    weaker = Signals(dataclasses.replace(s, high=5e5) for s in env.action_signals)
    with pytest.raises(PolicyFileError, match="differ in the action"):
        OnnxPolicy.load(ppo[1] / "policy.onnx", env.signals, weaker)
    OnnxPolicy.load(ppo[1] / "policy.onnx", env.signals, env.action_signals)


# --- files that are not policies -------------------------------------------------------------


class Doctored:
    """Unpickled, it makes a file."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> Any:
        return os.system, (f"touch {self.marker}",)


def doctored_zip(path: Path, model: PPO, marker: Path) -> Path:
    """Write a zip of stable-baselines3 that runs a command when it is loaded."""

    model.save(path)
    with zipfile.ZipFile(path) as old:
        entries = {name: old.read(name) for name in old.namelist()}
    data = json.loads(entries["data"])
    bomb = b64encode(cloudpickle.dumps(Doctored(marker))).decode()
    data["ep_info_buffer"] = {":type:": "x", ":serialized:": bomb}
    entries["data"] = json.dumps(data).encode()
    with zipfile.ZipFile(path, "w") as new:
        for name, content in entries.items():
            new.writestr(name, content)
    return path


def loaders(path: Path, tmp_path: Path) -> dict[str, Callable[[], Any]]:
    """Return every public function that opens a file of a policy or run."""
    folder = tmp_path / "run"
    folder.mkdir(exist_ok=True)
    (folder / "checkpoint.pt").write_bytes(path.read_bytes())
    return {
        "policy": lambda: OnnxPolicy.load(path),
        "show": lambda: main(["show", str(path)]) == 2 and _refused(),
        "config": lambda: configs.read(path),
        "resume": lambda: main(["train", ID, "--resume", "--out", str(folder)]) == 2 and _refused(),
        "train": lambda: main(["train", ID, "--config", str(path)]) == 2 and _refused(),
        "name": lambda: catalogue.load_pretrained(str(path)),
    }


def _refused() -> None:
    raise ValueError("refused")


@pytest.mark.parametrize("disguise", ["policy.zip", "policy.onnx", "policy.pt", "policy.yaml"])
def test_malicious_zip_is_not_executed(
    disguise: str, ppo: tuple[Any, Path], tmp_path: Path
) -> None:
    marker = tmp_path / "ran"
    bomb = doctored_zip(tmp_path / "bomb.zip", ppo[0], marker)
    path = tmp_path / disguise
    path.write_bytes(bomb.read_bytes())
    for load in loaders(path, tmp_path).values():
        with pytest.raises(ValueError):
            load()
    assert not marker.exists()


def test_malicious_zip_runs_code_in_stable_baselines(ppo: tuple[Any, Path], tmp_path: Path) -> None:
    """Without this, the test above could pass on a harmless file."""
    marker = tmp_path / "ran"
    bomb = doctored_zip(tmp_path / "bomb.zip", ppo[0], marker)
    PPO.load(bomb, device="cpu")
    assert marker.exists()


def test_zips_and_pickles_are_refused_with_the_reason(
    ppo: tuple[Any, Path], tmp_path: Path
) -> None:
    ppo[0].save(tmp_path / "own.zip")
    with pytest.raises(PolicyFileError, match=r"can run any code.*export_policy"):
        OnnxPolicy.load(tmp_path / "own.zip")


@pytest.mark.parametrize("protocol", [0, 2, 5])
def test_malicious_pickle_is_not_executed(protocol: int, tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    (tmp_path / "p.pkl").write_bytes(pickle.dumps(Doctored(marker), protocol=protocol))
    for load in loaders(tmp_path / "p.pkl", tmp_path).values():
        with pytest.raises(ValueError):
            load()
    assert not marker.exists()


class Gift:
    """A folder of files of sound formats that name an environment in a module of their own.

    Gymnasium imports the part before the colon, and the module makes a file.
    """

    def __init__(self, folder: Path, policy: Path) -> None:
        self.marker = folder / "ran"
        self.env = f"gift:{ID}"
        (folder / "gift.py").write_text(f"open({str(self.marker)!r}, 'w')\n")
        config = {**tiny().as_dict(), "env": self.env}
        (folder / "config.yaml").write_text(yaml.safe_dump(config))
        content = checkpoint.load(policy.with_name(CHECKPOINT))
        settings = json.loads(content["settings"])
        content["settings"] = json.dumps({**settings, "config": config})
        checkpoint.save(folder / CHECKPOINT, content)
        model = onnx.load_model(policy)
        card = {**OnnxPolicy.load(policy).card, "env": self.env, "config": config}
        del model.metadata_props[:]
        model.metadata_props.add(key=CARD, value=json.dumps(card))
        write_policy(folder / "policy.onnx", model.SerializeToString(), {})


@pytest.fixture
def gift(tmp_path: Path, ppo: tuple[Any, Path], monkeypatch: pytest.MonkeyPatch) -> Gift:
    """Return a gift whose module would be found."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "gift", raising=False)
    return Gift(tmp_path, ppo[1] / "policy.onnx")


def test_settings_cannot_import_a_module(
    gift: Gift, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", ID, "--resume", "--out", str(tmp_path)]) == 2
    assert "is no environment here" in capsys.readouterr().err
    for place in (tmp_path / "config.yaml", tmp_path / "policy.onnx"):
        for env in (ID, gift.env):
            assert main(["train", env, "--config", str(place), "--out", "nowhere"]) == 2
    with pytest.raises(SettingsError, match="is no environment here"):
        configs.read(tmp_path / "config.yaml")
    with pytest.raises(SettingsError, match="is no environment here"):
        saved_run(tmp_path)
    with pytest.raises(SettingsError, match="is no environment here"):
        Run(tiny(), 3, tmp_path).finished()
    assert main(["show", str(tmp_path / "policy.onnx")]) == 0
    assert not gift.marker.exists()


def test_gymnasium_imports_the_module_of_an_id(gift: Gift) -> None:
    """Without this, the test above could pass on a harmless name."""
    gym.make_vec(gift.env, 1, vectorization_mode="vector_entry_point")
    assert gift.marker.exists()


def graph(nodes: list[Any], numbers: Sequence[Any] = (), domains: Sequence[str] = ("",)) -> Any:
    """Return a model of observation -> action around nodes."""
    made = helper.make_graph(
        nodes,
        "g",
        [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["batch", 10])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 1])],
        list(numbers),
    )
    return helper.make_model(
        made, opset_imports=[helper.make_opsetid(d, 17 if not d else 1) for d in domains]
    )


def weights(name: str, shape: tuple[int, ...]) -> Any:
    return helper.make_tensor(name, TensorProto.FLOAT, shape, np.zeros(shape).ravel())


def external(path: Path) -> Any:
    tensor = weights("w", (10, 1))
    tensor.ClearField("float_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=str(path))
    return graph([helper.make_node("MatMul", ["observation", "w"], ["action"])], [tensor])


def outer() -> Any:
    """Return a graph whose values grow with the square of the batch."""
    nodes = [
        helper.make_node("Transpose", ["observation"], ["t"]),
        helper.make_node("MatMul", ["observation", "t"], ["square"]),
        helper.make_node("MatMul", ["square", "observation"], ["wide"]),
        helper.make_node("MatMul", ["wide", "w"], ["action"]),
    ]
    return graph(nodes, [weights("w", (10, 1))])


def loop() -> Any:
    inner = helper.make_graph(
        [helper.make_node("Identity", ["c"], ["o"])],
        "body",
        [
            helper.make_tensor_value_info("i", TensorProto.INT64, []),
            helper.make_tensor_value_info("c", TensorProto.BOOL, []),
        ],
        [helper.make_tensor_value_info("o", TensorProto.BOOL, [])],
    )
    return graph([helper.make_node("Loop", ["m", ""], ["action"], body=inner)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: external(p / "weights.bin"), "are in another file"),
        (lambda p: external(Path("../weights.bin")), "are in another file"),
        (
            lambda _: graph(
                [helper.make_node("PyOp", ["observation"], ["action"], domain="ai.evil")],
                domains=("", "ai.evil"),
            ),
            "operators of ai.evil",
        ),
        (lambda _: loop(), "operator Loop"),
        (
            lambda _: graph([helper.make_node("ConstantOfShape", ["observation"], ["action"])]),
            "operator ConstantOfShape",
        ),
        (lambda _: outer(), "not known in advance"),
        (
            lambda _: graph([helper.make_node("Identity", ["observation"], ["action"])]),
            "do not fit|not known in advance",
        ),
    ],
)
def test_graphs_beyond_plain_arithmetic_are_refused(
    make: Callable[[Path], Any], message: str, tmp_path: Path, ppo: tuple[Any, Path]
) -> None:
    model = make(tmp_path)
    card = OnnxPolicy.load(ppo[1] / "policy.onnx").card
    model.metadata_props.add(key=CARD, value=json.dumps(card))
    (tmp_path / "p.onnx").write_bytes(model.SerializeToString())
    with pytest.raises(PolicyFileError, match=message):
        OnnxPolicy.load(tmp_path / "p.onnx")


def test_large_empty_and_cardless_files_are_refused(tmp_path: Path, ppo: tuple[Any, Path]) -> None:
    file = tmp_path / "p.onnx"
    file.write_bytes(b"\x08" * (MOST_BYTES + 1))
    with pytest.raises(PolicyFileError, match="larger than"):
        OnnxPolicy.load(file)
    for content in (b"", b"not a policy", (ppo[1] / "policy.onnx").read_bytes()[:-400]):
        file.write_bytes(content)
        with pytest.raises(PolicyFileError):
            OnnxPolicy.load(file)
    with pytest.raises(PolicyFileError, match="cannot be read"):
        OnnxPolicy.load(tmp_path / "none.onnx")
    model = onnx.load_model(io.BytesIO((ppo[1] / "policy.onnx").read_bytes()))
    del model.metadata_props[:]
    model.metadata_props.add(key=CARD, value="[" * 100_000)
    file.write_bytes(model.SerializeToString())
    with pytest.raises(PolicyFileError, match="is not JSON"):
        OnnxPolicy.load(file)
    del model.metadata_props[:]
    file.write_bytes(model.SerializeToString())
    with pytest.raises(PolicyFileError, match="has no card"):
        OnnxPolicy.load(file)
