"""How big and how fast the card detectors are, and the whole way from image to state, on one core.

Times are processor time: what other programs do meanwhile does not count, helping threads would. What is compared takes
turns, crop by crop, so that a slow moment of the machine strikes all alike. A network's speed does not depend on its
weights: the baseline is timed untrained, so that it needs none shipped.
"""

from __future__ import annotations

import importlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from dr_eureka.bench.cards_map import TITLES, held_out_crop
from dr_eureka.bench.cards_states import SERIES, STATES, scene_of
from dr_eureka.bench.report import Row, progress
from dr_eureka.vision.card_weights import load_detector
from dr_eureka.vision.cards import CardReader

LEAST_FRAMES, LEAST_SPEED_UP = 50.0, 6.0
FEWEST_PARAMETERS, MOST_PARAMETERS = 225_000, 275_000
_PAPER_PARAMETERS = {"eureka": 250_000, "tiny": 11_000_000}
_OURS, _BASELINE = (f"{TITLES[model]}, torch" for model in ("eureka", "tiny"))
_PAPER_TIMES = {_OURS: "20 (i7-8700)", _BASELINE: "40 (i7-8700)"}
_PAPER_FRAMES = 50.0
_OPSET = 11  # of ONNX; the newest that OpenCV 4.6 reads whole
_IMAGES = 40
_WARM_UP = 3
_CHOICE = 102  # which random numbers: those that choose the scenes


def parameter_rows() -> list[Row]:
    """Return how many parameters each network has, and their ratio."""
    from dr_eureka.vision.card_architecture import MODELS, build_network, parameter_count

    counts = {model: parameter_count(build_network(model)) for model in MODELS}
    fits = FEWEST_PARAMETERS <= counts["eureka"] <= MOST_PARAMETERS
    return [
        Row(f"parameters, {TITLES['eureka']}", counts["eureka"], "1", None, None, _PAPER_PARAMETERS["eureka"],
            f"{FEWEST_PARAMETERS} .. {MOST_PARAMETERS}", fits),
        Row(f"parameters, {TITLES['tiny']}", counts["tiny"], "1", None, None, _PAPER_PARAMETERS["tiny"]),
        Row("parameters, YOLOv2-tiny over ours", counts["tiny"] / counts["eureka"], "ratio", None, None, 43.0),
    ]


def network_speed_rows(seed: int, rounds: int) -> list[Row]:
    """Return the time a crop takes in each network and, for ours, in each engine that is installed, and the ratios."""
    import torch

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    torch.manual_seed(1)
    with tempfile.TemporaryDirectory() as folder:
        engines = {**torch_engines(), **onnx_engines(Path(folder))}
        crops = [held_out_crop(seed, index).image for index in range(min(rounds, _IMAGES))]
        times = _times_in_turns(engines, crops, rounds)
    rows = [
        Row(f"time a crop, median, {title}", float(np.median(values)), "ms", rounds, _median_interval(values),
            _PAPER_TIMES.get(title))
        for title, values in times.items()
    ]
    speed_up = _ratio_row("speed, ours over YOLOv2-tiny", times[_BASELINE], times[_OURS])
    rows.append(replace(speed_up, paper=2.0, goal=f">= {LEAST_SPEED_UP:g}", ok=speed_up.value >= LEAST_SPEED_UP))
    others = {title: values for title, values in times.items() if title not in (_OURS, _BASELINE)}
    return rows + [_ratio_row(f"time a crop, {title} over torch", values, times[_OURS]) for title, values in others.items()]


def reading_speed_rows(seed: int, frames: int) -> list[Row]:
    """Return how long CardReader.read takes from a 640x480 image to a state, and the frames a second of its median.

    Each frame is another scene: how long reading takes depends on what is in it.
    """
    cv2.setNumThreads(1)
    reader = CardReader.load()
    rng = np.random.default_rng((seed, _CHOICE))
    chosen = [STATES[i] for i in rng.choice(len(STATES), frames, replace=len(STATES) < frames)]
    images = [scene_of(SERIES[0], seed, state, 0).image for state in chosen]
    times = _times_in_turns({"read": reader.read}, images, frames)["read"]
    median, late = float(np.median(times)), float(np.percentile(times, 95))
    low, high = _median_interval(times)
    rate = 1000 / median
    return [
        Row("image to state, median", median, "ms", frames, (low, high)),
        Row("image to state, 95th percentile", late, "ms", frames),
        Row("image to state, one core", rate, "frames/s", frames, (1000 / high, 1000 / low), _PAPER_FRAMES,
            f">= {LEAST_FRAMES:g}", rate >= LEAST_FRAMES),
    ]


def torch_engines() -> dict[str, Callable[[np.ndarray], object]]:
    """Return both networks as the robot uses them: folded, image to decoded grid, in torch."""
    from dr_eureka.vision.card_architecture import build_network, to_arrays
    from dr_eureka.vision.card_network import CardNetwork

    baseline = to_arrays(build_network("tiny").eval())
    return {
        _OURS: CardNetwork(load_detector("eureka"), 1, "eureka").detect,
        _BASELINE: CardNetwork(baseline, 1, "tiny").detect,
    }


def onnx_engines(folder: Path) -> dict[str, Callable[[np.ndarray], object]]:
    """Return our network in OpenCV's dnn and, where it is installed, onnxruntime: image to raw grid, without decoding."""
    import torch

    from dr_eureka.vision.card_architecture import INPUT_PX, from_arrays

    file = str(folder / "eureka.onnx")
    network, example = from_arrays(load_detector("eureka"), "eureka"), torch.zeros(1, 3, INPUT_PX, INPUT_PX)
    torch.onnx.export(network, example, file, opset_version=_OPSET)
    reader = cv2.dnn.readNetFromONNX(file)

    def by_opencv(image: np.ndarray) -> np.ndarray:
        reader.setInput(cv2.dnn.blobFromImage(image, 1 / 255.0))
        return reader.forward()

    engines: dict[str, Callable[[np.ndarray], object]] = {f"{TITLES['eureka']}, OpenCV dnn": by_opencv}
    try:
        runtime = importlib.import_module("onnxruntime")  # Debian has no package of it
    except ImportError:
        return engines
    options = runtime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = runtime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name

    def by_onnxruntime(image: np.ndarray) -> np.ndarray:
        return session.run(None, {name: cv2.dnn.blobFromImage(image, 1 / 255.0)})[0]

    return {**engines, f"{TITLES['eureka']}, onnxruntime": by_onnxruntime}


def _times_in_turns(
    engines: dict[str, Callable[[np.ndarray], object]], inputs: Sequence[np.ndarray], rounds: int
) -> dict[str, list[float]]:
    """Return each engine's processor times [ms], one a round, after a few rounds to warm up."""
    times: dict[str, list[float]] = {name: [] for name in engines}
    for index in progress(range(-_WARM_UP, rounds), rounds + _WARM_UP, "speed"):
        for name, run in engines.items():
            started = time.process_time()
            run(inputs[index % len(inputs)])
            if index >= 0:
                times[name].append(1000 * (time.process_time() - started))
    return times


def _ratio_row(name: str, above: Sequence[float], below: Sequence[float]) -> Row:
    """Return the median over the rounds of one time over another."""
    ratios = np.array(above) / np.array(below)
    return Row(name, float(np.median(ratios)), "ratio", len(ratios), _median_interval(ratios))


def _median_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of a median: the order statistics that the binomial distribution gives."""
    from scipy.stats import binom

    ranked, n = np.sort(values), len(values)
    low = int(binom.ppf(0.025, n, 0.5))
    return float(ranked[max(low - 1, 0)]), float(ranked[min(n - low, n - 1)])
