"""Policy files: agreement with torch, rows, signals, and refusal of harmful files."""

import dataclasses
import io
import itertools
import json
import os
import pickle
import sys
import zipfile
from base64 import b64encode
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import cloudpickle
import gymnasium as gym
import numpy as np
import onnx
import pytest
import yaml
from onnx import TensorProto, helper
from short_runs import ID, tiny, with_card
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


def observations(number: int) -> np.ndarray:
    n = len(gym.make(ID).unwrapped.signals)
    return np.random.default_rng(1).uniform(-1, 1, (number, n)).astype(np.float32)


def test_normaliser_is_part_of_the_file(normalized_ppo):
    model, folder = normalized_ppo
    seen = observations(50)
    action, _ = OnnxPolicy.load(folder / "policy.onnx").predict(seen)
    assert np.abs(action - model.predict(seen)[0]).max() > 1e-3


def test_actions_are_clipped_to_the_range(ppo):
    policy = OnnxPolicy.load(ppo[1] / "policy.onnx")
    action, _ = policy.predict(1e6 * observations(200))
    assert np.abs(action).max() == 1.0
    assert set(np.sign(action).ravel()) == {-1.0, 1.0}


def test_predict_has_the_controllers_interface(ppo):
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


def test_equal_weights_give_equal_bytes(ppo, tmp_path):
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
def test_environment_with_other_signals_is_refused(arguments, message, ppo):
    env = gym.make(ID, **arguments).unwrapped
    with pytest.raises(PolicyFileError, match=message):
        OnnxPolicy.load(ppo[1] / "policy.onnx", env.signals, env.action_signals)


def test_environment_with_another_action_is_refused(ppo):
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


def doctored_zip(marker: Path) -> bytes:
    """Return a zip of stable-baselines3 that runs a command when it is loaded."""
    bomb = b64encode(cloudpickle.dumps(Doctored(marker))).decode()
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as file:
        file.writestr("data", json.dumps({"policy": {":type:": "x", ":serialized:": bomb}}))
    return made.getvalue()


def test_doctored_zip_runs_its_command_in_stable_baselines(tmp_path):
    """Without this, the test below could pass on a harmless file."""
    (tmp_path / "bomb.zip").write_bytes(doctored_zip(tmp_path / "ran"))
    with suppress(KeyError):
        PPO.load(tmp_path / "bomb.zip", device="cpu")
    assert (tmp_path / "ran").exists()


@pytest.mark.parametrize("name", ["policy.zip", "policy.onnx", "policy.pt", "policy.yaml"])
@pytest.mark.parametrize("protocol", [None, 0, 5], ids=str)
def test_file_that_runs_code_is_opened_nowhere(name, protocol, tmp_path):
    path, marker = tmp_path / name, tmp_path / "ran"
    pickled = None if protocol is None else pickle.dumps(Doctored(marker), protocol)
    path.write_bytes(pickled or doctored_zip(marker))
    (tmp_path / CHECKPOINT).write_bytes(path.read_bytes())
    for load in (OnnxPolicy.load, configs.read, lambda path: catalogue.load_pretrained(str(path))):
        with pytest.raises(ValueError):
            load(path)
    train = ["train", ID]
    for command in (["--config", str(path)], ["--resume", "--out", str(tmp_path)]):
        assert main([*train, *command]) == 2
    assert main(["show", str(path)]) == 2
    assert not marker.exists()


def test_zip_is_refused_with_the_reason(tmp_path):
    (tmp_path / "own.zip").write_bytes(doctored_zip(tmp_path / "ran"))
    with pytest.raises(PolicyFileError, match=r"can run any code.*export_policy"):
        OnnxPolicy.load(tmp_path / "own.zip")


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
        write_policy(folder / "policy.onnx", with_card(policy, env=self.env, config=config), {})


@pytest.fixture
def gift(tmp_path, ppo, monkeypatch):
    """Return a gift whose module would be found."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "gift", raising=False)
    return Gift(tmp_path, ppo[1] / "policy.onnx")


def test_settings_cannot_import_a_module(gift, tmp_path, capsys):
    assert main(["train", ID, "--resume", "--out", str(tmp_path)]) == 2
    assert "is no environment here" in capsys.readouterr().err
    for place in (tmp_path / "config.yaml", tmp_path / "policy.onnx"):
        for env in (ID, gift.env):
            assert main(["train", env, "--config", str(place), "--out", "nowhere"]) == 2
    config, run = tmp_path / "config.yaml", Run(tiny(), 3, tmp_path)
    for read in (lambda: configs.read(config), lambda: saved_run(tmp_path), run.finished):
        with pytest.raises(SettingsError, match="is no environment here"):
            read()
    assert main(["show", str(tmp_path / "policy.onnx")]) == 0
    assert not gift.marker.exists()
    gym.make_vec(gift.env, 1, vectorization_mode="vector_entry_point")  # the name is harmful
    assert gift.marker.exists()


def info(name: str, kind: int = TensorProto.FLOAT, shape: Sequence[Any] = ()) -> Any:
    return helper.make_tensor_value_info(name, kind, shape)


def graph(nodes: Sequence[Any], numbers: Sequence[Any] = (), domains: Sequence[str] = ("",)) -> Any:
    """Return a model of observation -> action around nodes."""
    ends = info("observation", shape=["batch", 10]), info("action", shape=["batch", 1])
    made = helper.make_graph(nodes, "g", ends[:1], ends[1:], list(numbers))
    versions = [helper.make_opsetid(d, 17 if not d else 1) for d in domains]
    return helper.make_model(made, opset_imports=versions)


def node(kind: str, source: str = "observation", target: str = "action", **more: Any) -> Any:
    return helper.make_node(kind, source.split(), [target], **more)


def weights() -> Any:
    return helper.make_tensor("w", TensorProto.FLOAT, (10, 1), np.zeros(10))


def external(path: str) -> Any:
    tensor = weights()
    tensor.ClearField("float_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=path)
    return graph([node("MatMul", "observation w")], [tensor])


def outer() -> Any:
    """Return a graph whose values grow with the square of the batch."""
    nodes = [
        node("Transpose", target="t"),
        node("MatMul", "observation t", "square"),
        node("MatMul", "square observation", "wide"),
        node("MatMul", "wide w"),
    ]
    return graph(nodes, [weights()])


def loop() -> Any:
    ends = info("i", TensorProto.INT64), info("c", TensorProto.BOOL), info("o", TensorProto.BOOL)
    inner = helper.make_graph([node("Identity", "c", "o")], "body", ends[:2], ends[2:])
    return graph([helper.make_node("Loop", ["m", ""], ["action"], body=inner)])


def undeclared(kind: str) -> Any:
    """Return a graph whose dynamic reshape is declared small in ``value_info``."""
    shape = node("Cast", "observation", "shape", to=TensorProto.INT64)
    nodes = [node("Flatten", target="flat"), node("Slice", "flat at to", "few"), shape]
    if kind == "Reshape":
        nodes += [node("Reshape", "observation shape", "wide")]
    else:
        nodes += [node("Reshape", "observation shape", "r"), node("MatMul", "r r", "wide")]
    ends = [helper.make_tensor(n, TensorProto.INT64, (1,), [v]) for n, v in (("at", 0), ("to", 1))]
    made = graph([*nodes, node("MatMul", "wide w")], [weights(), *ends])
    for name in ("shape", "wide", "r"):
        made.graph.value_info.append(info(name, shape=[1, 1]))
    return made


def long(kind: str, number: int, wide: bool) -> Any:
    """Return a graph of a chain of operators, over values of 90,000 numbers a row if ``wide``."""
    names = ["observation", *(f"v{i}" for i in range(number - 1)), "action"]
    big = helper.make_tensor("b", TensorProto.FLOAT, (10, 90_000), b"\0" * 3_600_000, raw=True)
    first = [node("MatMul", "observation b", "v0")] if wide else [node(kind, target="v0")]
    rest = [node(kind, a, b) for a, b in itertools.pairwise(names[1:])]
    return graph([*first, *rest], [big] if wide else [])


def growing(kind: str) -> Any:
    """Return a graph whose batch axis grows: by doubling, or by a wide value laid out as rows."""
    if kind == "Concat":
        names = ["observation", *(f"v{i}" for i in range(30))]
        nodes = [node("Concat", f"{a} {a}", b, axis=0) for a, b in itertools.pairwise(names)]
        return graph([*nodes, node("MatMul", f"{names[-1]} w")], [weights()])
    wide = helper.make_tensor("b", TensorProto.FLOAT, (10, 50_000), bytes(2_000_000), raw=True)
    long = helper.make_tensor("c", TensorProto.FLOAT, (1, 50_000), bytes(200_000), raw=True)
    shape = helper.make_tensor("shape", TensorProto.INT64, (2,), [-1, 1])
    nodes = [
        node("MatMul", "observation b", "wide"),
        node("Reshape", "wide shape", "rows"),
        node("MatMul", "rows c", "huge"),
        node("Transpose", "huge", "action"),
    ]
    return graph(nodes, [wide, long, shape])


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (growing("Concat"), "not known in advance"),
        (growing("Reshape"), "not known in advance"),
        (graph([node("Op\x1b[2J")]), r"operator Op\\x1b\[2J;"),
        (graph([node("Op", domain="\x1b[2J")], domains=("", "\x1b[2J")), r"of \\x1b\[2J;"),
        (undeclared("Reshape"), "not known in advance|do not fit"),
        (undeclared("MatMul"), "not known in advance|do not fit"),
        (long("Tanh", 501, False), "has 501 operators"),
        (long("Tanh", 60_000, False), "has 60,000 operators"),
        (long("Tanh", 20, True), "all values together"),
        (external("/tmp/weights.bin"), "are in another file"),
        (external("../weights.bin"), "are in another file"),
        (graph([node("PyOp", domain="evil")], domains=("", "evil")), "operators of evil"),
        (loop(), "operator Loop"),
        (graph([node("ConstantOfShape")]), "operator ConstantOfShape"),
        (outer(), "not known in advance"),
        (graph([node("Identity")]), "do not fit|not known in advance"),
    ],
)
def test_graphs_beyond_plain_arithmetic_are_refused(model, message, tmp_path, ppo):
    card = OnnxPolicy.load(ppo[1] / "policy.onnx").card
    model.metadata_props.add(key=CARD, value=json.dumps(card))
    (tmp_path / "p.onnx").write_bytes(model.SerializeToString())
    with pytest.raises(PolicyFileError, match=message):
        OnnxPolicy.load(tmp_path / "p.onnx")


@pytest.mark.parametrize(
    "text", [{"unit": '*/ int x = system("id"); /*'}, {"name": 'x"'}, {"unit": "N\n"}, {"name": 3}]
)
def test_signals_that_would_change_exported_source_code_are_refused(text, ppo):
    policy = OnnxPolicy.load(ppo[1] / "policy.onnx")
    first, *rest = policy.card["signals"]
    card = {**policy.card, "signals": [{**first, **text}, *rest]}
    with pytest.raises(PolicyFileError, match="describes no signals"):
        OnnxPolicy(policy.data, card)


def test_large_empty_and_cardless_files_are_refused(tmp_path, ppo):
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
