"""`retouch train` makes of a data set a net that errs less than what it started from, and says how much."""

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

import tactile
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from retouch.commands.main import main
from retouch.laboratory.training.dataset import make_dataset, plan_dataset
from retouch.laboratory.training.look import LookLoss, studio_sky
from retouch.laboratory.training.look import examples_of as look_examples
from retouch.laboratory.training.setup import Kind
from retouch.laboratory.training.shard_jobs import run_shard
from retouch.laboratory.training.touch import examples_of, touch_loss
from retouch.laboratory.training.touch_accuracy import errors, measure_textures
from retouch.laboratory.training.train import CURVES_PAGE, TrainingRequest, train_net
from retouch.laboratory.workers.processes import run_here
from surrogate.data.field_set import open_fieldset
from surrogate.nets.augmentation import SYMMETRIES
from surrogate.nets.training import TrainingSettings
from surrogate.nets.training import errors as errors_of
from surrogate.nets.training_checkpoint import CHECKPOINT_FILE, CURVES
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import ModelCard, load_net, weights_path
from tactile.net import CHANNELS
from tests.tactile.reliefs import SIZE
from visual.fast import ambient_net

pytestmark = pytest.mark.slow

SIDE = 32
SETTINGS = TrainingSettings(seed=1, epochs=12, batch=8, warmup=5)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus of which a net can be trained in seconds."""
    folder = tmp_path_factory.mktemp("data")
    plan = plan_dataset(5, 96, (), touch="layer", lights="none", samples=SIDE)
    assert not make_dataset(plan, folder, partial(run_here, workers=1, work=run_shard), lambda made: None)
    return folder


@pytest.fixture(scope="module")
def training(data: Path, tmp_path_factory: pytest.TempPathFactory) -> TrainingRequest:
    out = tmp_path_factory.mktemp("out")
    return TrainingRequest(data, out, SETTINGS, widths=(8, 12, 16), tested=12, reference="layer")


@pytest.fixture(scope="module")
def trained(training: TrainingRequest) -> TrainingRequest:
    train_net("touch", training)
    return training


def test_a_net_errs_less_than_the_solver_steps_that_it_starts_from(trained: TrainingRequest) -> None:
    """The configuration that continuous integration trains: under a minute on one core."""
    data = open_fieldset(trained.data)
    loss = touch_loss(tactile.Skin(), SIDE, SIZE)
    validation = examples_of(data, "validation", loss)
    net, card = load_net("touch", trained.out)
    untrained = float(errors_of(UNet(net.shape), loss, validation).mean())
    error = float(errors_of(net, loss, validation).mean())
    assert error < 0.8 * untrained and error < 0.35
    assert card.training["best validation error"] == pytest.approx(error, rel=1e-5)


def test_its_card_tells_what_it_is_and_how_far_it_errs(trained: TrainingRequest) -> None:
    _, card = load_net("touch", trained.out)
    assert card.shape.inputs == CHANNELS and card.shape.widths == (8, 12, 16)
    assert card.valid["samples"] == SIDE and card.valid["poisson_ratio"] == 0.48
    assert card.data["train textures"] == open_fieldset(trained.data).count("train")
    assert card.training["seed"] == 1 and card.training["epochs done"] == 12
    assert 0.0 < card.errors["roughness_median_percent"] < 15.0
    assert 0.5 < card.errors["gradient_cosine_median"] <= 1.0
    assert card.versions["torch"].startswith(torch.__version__.partition("+")[0])
    assert len(card.sample) == 4


def test_it_leaves_curves(trained: TrainingRequest) -> None:
    assert len((trained.out / CURVES).read_text(encoding="utf-8").splitlines()) == 12
    page = (trained.out / CURVES_PAGE).read_text(encoding="utf-8")
    assert "<svg" in page and "12 epochs" in page and "http:" not in page and "https:" not in page


def test_a_training_that_was_stopped_ends_at_the_same_file(trained: TrainingRequest, tmp_path: Path) -> None:
    again = replace(trained, out=tmp_path)

    def stop(epoch: object) -> None:
        if getattr(epoch, "number", 0) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_net("touch", again, stop)
    assert (tmp_path / CHECKPOINT_FILE).is_file() and not weights_path("touch", tmp_path).exists()
    train_net("touch", replace(again, resume=True))
    assert weights_path("touch", tmp_path).read_bytes() == weights_path("touch", trained.out).read_bytes()


def test_two_commands_do_not_train_in_one_folder(trained: TrainingRequest) -> None:
    with only_writer(trained.out):
        for resume in (False, True):
            with pytest.raises(InputError, match="another command is writing into this"):
                train_net("touch", replace(trained, resume=resume))


def test_the_task_is_as_symmetric_as_the_square(trained: TrainingRequest) -> None:
    loss = touch_loss(tactile.Skin(), SIDE, SIZE)
    validation = examples_of(open_fieldset(trained.data), "validation", loss)
    net, _ = load_net("touch", trained.out)
    blind = UNet(net.shape)
    for symmetry in range(SYMMETRIES):
        found = loss.errors(blind, loss.transformed(validation, symmetry))
        torch.testing.assert_close(found, loss.errors(blind, validation), rtol=1e-3, atol=1e-5)


def test_a_model_compared_with_itself_has_no_error() -> None:
    reliefs = np.random.default_rng(0).uniform(0.0, 0.5, (3, SIDE, SIDE)).astype(np.float32)
    reliefs[2] = 0.0
    found = measure_textures(partial(tactile.press, size_mm=SIZE), reliefs, SIZE, torch.float64, 2)
    same = errors(found, found)
    assert same["textures"] == 3 and same["textures_with_roughness"] == 2
    assert same["roughness_mean_percent"] == same["contact_area_95th_percent"] == 0.0
    assert same["gradient_cosine_5th"] == pytest.approx(1.0)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["train", "touch", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("retouch: ") and err.count("\n") == 1
    return err


def test_the_command_trains_and_tells(
    trained: TrainingRequest, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Against finite elements, on few textures."""
    arguments = ["--data", str(trained.data), "-o", str(tmp_path), "--epochs", "1", "--widths", "4,4"]
    assert main(["train", "touch", *arguments]) == 0
    told, shown = capsys.readouterr()
    assert shown.startswith("epoch 1 of at most 1: loss ") and "all of 1 epochs are done" in told
    assert "roughness median percent: " in told
    assert json.loads((tmp_path / "touch.json").read_text(encoding="utf-8"))["versions"]["reference"] == "fem"


def test_a_training_that_goes_astray_leaves_no_net(
    trained: TrainingRequest, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "astray")
    arguments = ["--widths", "4,4", "--epochs", "2", "--learning-rate", "1e30", "-q"]
    assert "a smaller learning rate" in refusal(capsys, "--data", str(trained.data), "-o", out, *arguments)
    assert not weights_path("touch", Path(out)).exists()


def test_what_is_wrong_is_told_in_one_line(
    trained: TrainingRequest, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, new = ["--data", str(trained.data)], str(tmp_path / "new")
    assert "dataset.json" in refusal(capsys, "--data", new, "-o", new)
    assert "--resume" in refusal(capsys, *data, "-o", str(trained.out))
    assert "nothing to go on from" in refusal(capsys, *data, "-o", new, "--resume")
    assert "begun with" in refusal(capsys, *data, "-o", str(trained.out), "--resume", "--seed", "7")
    assert "--minutes" in refusal(capsys, *data, "-o", new, "--minutes", "-1")
    assert "--widths" in refusal(capsys, *data, "-o", new, "--widths", "8,x")
    assert "multiple of 128" in refusal(capsys, *data, "-o", new, "--widths", "2,2,2,2,2,2")
    if not torch.cuda.is_available():
        assert "--device" in refusal(capsys, *data, "-o", new, "--device", "cuda")
    assert not (tmp_path / "new").exists()


@pytest.fixture(scope="module")
def looked_at(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small corpus with pictures under ambient light."""
    folder = tmp_path_factory.mktemp("looked_at")
    plan = plan_dataset(6, 48, (), touch="none", lights="random", directions=1, samples=SIDE)
    assert not make_dataset(plan, folder, partial(run_here, workers=1, work=run_shard), lambda made: None)
    return folder


@pytest.fixture(scope="module")
def look_trained(looked_at: Path, tmp_path_factory: pytest.TempPathFactory) -> TrainingRequest:
    training = TrainingRequest(
        looked_at, tmp_path_factory.mktemp("look"), SETTINGS, widths=(8, 12, 16), tested=6
    )
    card = train_net("look", training)
    assert load_net("look", training.out)[1] == card
    return training


def test_the_rendering_net_mends_what_rough_horizons_tell(
    looked_at: Path, look_trained: TrainingRequest
) -> None:
    net, card = load_net("look", look_trained.out)
    assert card.valid["samples"] == SIDE and net.shape.inputs == ambient_net.CHANNELS
    data, loss = open_fieldset(looked_at), LookLoss(SIZE)
    seen, validation = (look_examples(data, split, studio_sky()) for split in ("train", "validation"))
    untrained, trained = (float(errors_of(n, loss, seen).mean()) for n in (UNet(net.shape), net))
    assert trained < 0.9 * untrained and trained < 0.05
    best = float(errors_of(net, loss, validation).mean())
    assert card.training["best validation error"] == pytest.approx(best, rel=1e-4)
    assert best <= float(errors_of(UNet(net.shape), loss, validation).mean())
    assert 0.0 < card.errors["ambient_mean_percent"] < 15.0
    assert {sample.figures["mean_openness"] for sample in card.sample} > set()


def test_its_pictures_turn_with_the_relief(looked_at: Path) -> None:
    examples = look_examples(open_fieldset(looked_at), "train", studio_sky())
    loss, net = LookLoss(SIZE), UNet(NetShape(ambient_net.CHANNELS, 1, (4, 4), 2))
    few = {name: values[:2] for name, values in examples.items()}
    errors = [errors_of(net, loss, loss.transformed(few, symmetry)) for symmetry in range(SYMMETRIES)]
    for error in errors[1:]:
        # Faces turn along: only the diagonal that cells are cut along does not.
        torch.testing.assert_close(error, errors[0], rtol=0.05, atol=0.002)


def test_the_rendering_net_needs_pictures(data: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="lights: none"):
        train_net("look", TrainingRequest(data, tmp_path, SETTINGS))


def cards_of_three_seeds(kind: Kind, trained: TrainingRequest, folder: Path) -> Iterator[ModelCard]:
    """The card of a net that is trained, and of two that differ by their seed alone."""
    yield load_net(kind, trained.out)[1]
    for seed in (2, 3):
        yield train_net(kind, replace(trained, out=folder / str(seed), settings=replace(SETTINGS, seed=seed)))


def test_three_seeds_make_touch_nets_that_err_alike(trained: TrainingRequest, tmp_path: Path) -> None:
    """What is told of a net is no luck: the smallest configuration, from three beginnings."""
    found = []
    for card in cards_of_three_seeds("touch", trained, tmp_path):
        assert card.errors["roughness_mean_percent"] < 6.0
        assert card.errors["contact_area_mean_percent"] < 6.0
        found.append(float(card.training["best validation error"]))
    assert max(found) < 0.4 and max(found) < 1.3 * min(found)


def test_three_seeds_make_rendering_nets_that_err_alike(
    look_trained: TrainingRequest, tmp_path: Path
) -> None:
    found = []
    for card in cards_of_three_seeds("look", look_trained, tmp_path):
        found.append(float(card.training["best validation error"]))
        assert card.errors["ambient_mean_percent"] < 8.0
    assert max(found) < 0.02 and max(found) < 1.3 * min(found)
