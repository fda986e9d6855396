"""A sheet of what the card reader sees (paper Figure 15): easy scenes, the hardest that it read, some that it did not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np

from dr_eureka.bench.cards_map import Crop, held_out_crop
from dr_eureka.bench.cards_states import Series, Trial, scene_of
from dr_eureka.vision.card_detections import CropDetections, SeenBall, SeenFoot
from dr_eureka.vision.cards import CardReader, CardReading

_COLUMNS = 4
_PANEL_PX = (400, 300)
_CAPTION_PX = 44
_SURE = 0.5  # least confidence of what is drawn
_INK = {"R": (255, 90, 60), "G": (150, 255, 60), "P": (240, 110, 255)}
_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_samples(
    series: Series, trials: Sequence[Trial], seed: int, seen: Sequence[CropDetections], file: Path
) -> None:
    """Write a PNG of scenes with what was read in them, and of two ordinary and two hard held-out crops with what was seen.

    trials: of the series and seed; seen: our detector's answers for the crops. Scenes and crops are drawn again.
    """
    reader = CardReader.load()
    panels = []
    for title, trial in telling_trials(trials):
        image = scene_of(series, seed, trial.state, trial.view).image
        panels.append(_scene_panel(image, reader.read(image), title, trial.state))
    panels += [np.zeros_like(panels[0])] * (-len(panels) % _COLUMNS)
    hardest = sorted(range(2, len(seen)), key=lambda index: _how_easy(seen[index]))
    panels += [_crop_panel(held_out_crop(seed, index), seen[index]) for index in (0, 1, *hardest[:_COLUMNS - 2])]
    rows = [np.hstack(panels[i:i + _COLUMNS]) for i in range(0, len(panels), _COLUMNS)]
    cv2.imwrite(str(file), cv2.cvtColor(np.vstack(rows), cv2.COLOR_RGB2BGR))


def telling_trials(trials: Sequence[Trial]) -> list[tuple[str, Trial]]:
    """Return two ordinary trials, the extreme ones that were read, and up to four that were not, each with a title."""
    read = [trial for trial in trials if trial.right] or list(trials)
    missed = sorted((trial for trial in trials if not trial.right), key=lambda trial: not trial.wrong)
    return [
        ("any", read[0]),
        ("any", read[len(read) // 2]),
        ("smallest", min(read, key=lambda trial: trial.side_px)),
        ("most tilted", max(read, key=lambda trial: trial.tilt)),
        ("darkest", min(read, key=lambda trial: trial.exposure)),
        ("brightest", max(read, key=lambda trial: trial.exposure)),
        ("most motion blur", max(read, key=lambda trial: trial.motion_px)),
        ("closest tubes", min(read, key=lambda trial: trial.spacing)),
        *(("read wrong" if trial.wrong else "not read", trial) for trial in missed[:_COLUMNS]),
    ]


def _scene_panel(image: np.ndarray, reading: CardReading, title: str, state: str) -> np.ndarray:
    """Return a scene with the card's outline, its printed upper left as a dot, the balls, and a caption."""
    image = image.copy()
    if reading.corners is not None:
        corners = reading.corners.astype(np.float32)
        cv2.polylines(image, [corners.round().astype(int)], True, (0, 255, 255), 2, cv2.LINE_AA)
        cv2.circle(image, tuple(int(v) for v in corners[0].round()), 6, (0, 255, 255), -1, cv2.LINE_AA)
    answer = f"{reading.state} ({reading.confidence:.2f})" if reading.state else reading.result
    return _panel(image, f"{title}, shown {state}", answer if reading.state else f"{answer}: {reading.reason}")


def _crop_panel(crop: Crop, found: CropDetections) -> np.ndarray:
    """Return a crop with a box, letter and confidence for each ball detected and a cross for each foot."""
    image = crop.image.copy()
    side = image.shape[0]
    balls, feet = _sure(found.balls), _sure(found.feet)
    for ball in balls:
        x, y, reach = ball.x * side, ball.y * side, ball.diameter * side / 2
        cv2.rectangle(image, (int(x - reach), int(y - reach)), (int(x + reach), int(y + reach)), _INK[ball.colour], 2)
        _write(image, f"{ball.colour} {ball.confidence:.2f}", (int(x - reach), int(y)), 0.5)
    for foot in feet:
        place = (int(foot.x * side), int(foot.y * side))
        cv2.drawMarker(image, place, (0, 255, 255), cv2.MARKER_TILTED_CROSS, 16, 2, cv2.LINE_AA)
    return _panel(image, "held-out crop", f"{len(balls)} balls, {len(feet)} feet")


def _how_easy(found: CropDetections) -> tuple[int, float]:
    """Return what orders crops from hard to easy: how many balls were seen, and how sure the least sure one was."""
    balls = _sure(found.balls)
    return len(balls), min((ball.confidence for ball in balls), default=0.0)


def _sure(things: Iterable[SeenBall | SeenFoot]) -> list:
    return [thing for thing in things if thing.confidence >= _SURE]


def _panel(image: np.ndarray, *lines: str) -> np.ndarray:
    """Return an image fitted into a panel above two lines of text."""
    width, height = _PANEL_PX
    scale = min(width / image.shape[1], height / image.shape[0])
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    panel = np.zeros((height + _CAPTION_PX, width, 3), np.uint8)
    left = (width - small.shape[1]) // 2
    panel[:small.shape[0], left:left + small.shape[1]] = small[:height, :width]
    for row, line in enumerate(lines, 1):
        cv2.putText(panel, line[:56], (4, height + 18 * row), _FONT, 0.42, _WHITE, 1, cv2.LINE_AA)
    return panel


def _write(image: np.ndarray, text: str, place: tuple[int, int], size: float) -> None:
    """Write white text with a black rim, readable on anything."""
    cv2.putText(image, text, place, _FONT, size, _BLACK, 3, cv2.LINE_AA)
    cv2.putText(image, text, place, _FONT, size, _WHITE, 1, cv2.LINE_AA)
