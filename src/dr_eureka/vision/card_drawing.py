"""A card reading drawn into the picture that was read, for a person who wants to see why it was decided so, or not."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from dr_eureka.vision.card_detections import SeenBall
from dr_eureka.vision.cards import CardReading, CardResult

_GOOD, _BAD, _TEXT, _SHADE = (60, 230, 60), (255, 150, 0), (255, 255, 255), (0, 0, 0)
_INKS = {"R": (255, 60, 60), "G": (60, 255, 60), "P": (220, 130, 255)}
_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_FONT_PX = 22.0  # height of a line of the font at scale 1
_INSET_SHARE = 0.36  # [of the picture's shorter side]
_SMALLEST_PX = 120  # a smaller picture has no room for an inset or text
_CIRCLE = np.stack([f(np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)) for f in (np.cos, np.sin)], axis=-1) / 2.0


def balls_in_image(reading: CardReading) -> tuple[SeenBall, ...]:
    """Return the balls of a reading with centre and diameter in pixels of the picture; none without corners."""
    if reading.corners is None:
        return ()
    image_from_card = cv2.getPerspectiveTransform(_SQUARE, np.asarray(reading.corners, np.float32))
    return tuple(_moved(ball, image_from_card) for ball in reading.balls)


def draw_card_reading(image_rgb: np.ndarray, reading: CardReading) -> np.ndarray:
    """Return a copy of a picture (h, w, 3) uint8 rgb with what was read in it.

    The card's outline and a mark over its upper side when it could be read, a ring for each ball, in a corner the card
    seen straight with each ball's letter and confidence, and below result, state and reason as text.
    """
    picture = np.ascontiguousarray(image_rgb).copy()
    roomy = min(picture.shape[:2]) >= _SMALLEST_PX
    if reading.corners is not None:
        corners = np.asarray(reading.corners, np.float32)
        inset = _straight_card(image_rgb, reading) if roomy else None
        _outline(picture, corners, reading.result == CardResult.OK)
        for ball in balls_in_image(reading):
            _ring(picture, ball)
        if inset is not None:
            _put_into_corner(picture, inset, corners.mean(axis=0))
    if roomy:
        _write_below(picture, reading)
    return picture


def _moved(ball: SeenBall, homography: np.ndarray) -> SeenBall:
    """Return a ball as a homography shows it; its diameter is that of a circle of the same area."""
    around = (_CIRCLE * ball.diameter + (ball.x, ball.y)).astype(np.float32)
    ring = cv2.perspectiveTransform(around[None], homography)[0]
    (x, y), = cv2.perspectiveTransform(np.array([[(ball.x, ball.y)]], np.float32), homography)[0]
    diameter = float(np.sqrt(4.0 / np.pi * cv2.contourArea(ring)))
    return replace(ball, x=float(x), y=float(y), diameter=diameter)


def _outline(picture: np.ndarray, corners: np.ndarray, upright_known: bool) -> None:
    ink, width = (_GOOD if upright_known else _BAD), max(1, round(picture.shape[0] / 240))
    cv2.polylines(picture, [np.round(corners).astype(np.int32)], True, ink, width, cv2.LINE_AA)
    if upright_known:
        upper_left, upper_right, lower_right, lower_left = corners
        middle = (upper_left + upper_right) / 2
        up = (middle - (lower_left + lower_right) / 2) / 8
        along = (upper_right - upper_left) / 12
        cv2.fillPoly(picture, [np.round([middle + up, middle + along, middle - along]).astype(np.int32)], ink, cv2.LINE_AA)


def _ring(picture: np.ndarray, ball: SeenBall) -> None:
    centre, radius = (round(ball.x), round(ball.y)), max(1, round(ball.diameter / 2))
    width = max(1, round(ball.diameter / 12))
    cv2.circle(picture, centre, radius, _SHADE, 3 * width, cv2.LINE_AA)
    cv2.circle(picture, centre, radius, _INKS[ball.colour], width, cv2.LINE_AA)


def _straight_card(image_rgb: np.ndarray, reading: CardReading) -> np.ndarray:
    """Return the card seen straight, (side, side, 3), with letter and confidence of each ball."""
    side = round(_INSET_SHARE * min(image_rgb.shape[:2]))
    homography = cv2.getPerspectiveTransform(np.asarray(reading.corners, np.float32), _SQUARE * side)
    inset = cv2.warpPerspective(image_rgb, homography, (side, side))
    for ball in reading.balls:
        ball = replace(ball, x=ball.x * side, y=ball.y * side, diameter=ball.diameter * side)
        _ring(inset, ball)
        label = f"{ball.colour} {100 * ball.confidence:.0f}"
        scale = 0.9 * ball.diameter / cv2.getTextSize(label, _FONT, 1.0, 1)[0][0]
        _write(inset, label, (ball.x - 0.45 * ball.diameter, ball.y + 0.3 * _FONT_PX * scale), scale)
    return cv2.copyMakeBorder(inset, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=_TEXT)


def _put_into_corner(picture: np.ndarray, inset: np.ndarray, card_centre: np.ndarray) -> None:
    """Put the inset into the upper corner that is farther from the card."""
    width = inset.shape[1]
    left = 0 if card_centre[0] > picture.shape[1] / 2 else picture.shape[1] - width
    picture[: inset.shape[0], left : left + width] = inset


def _write_below(picture: np.ndarray, reading: CardReading) -> None:
    """Write result and state, and below them the reason, on a darkened strip."""
    read = reading.result == CardResult.OK
    lines = [f"{reading.state}  {100 * reading.confidence:.0f} %"] if read else [reading.result, reading.reason]
    scale = picture.shape[0] / 800
    pitch = 1.5 * _FONT_PX * scale
    strip = picture[-round(pitch * (len(lines) + 0.4)) :]
    strip //= 3
    for number, line in enumerate(lines):
        widest = cv2.getTextSize(line, _FONT, scale, 1)[0][0]
        fitting = scale * min(1.0, 0.97 * picture.shape[1] / max(widest, 1))
        place = (0.01 * picture.shape[1], picture.shape[0] - pitch * (len(lines) - number - 0.6))
        _write(picture, line, place, fitting, (_GOOD if read else _BAD) if number == 0 else _TEXT)


def _write(picture: np.ndarray, text: str, place: tuple[float, float], scale: float, ink=_TEXT) -> None:
    """Write text from its lower left, with a dark rim that keeps it legible on any ground."""
    at, width = (round(place[0]), round(place[1])), max(1, round(scale * 1.6))
    cv2.putText(picture, text, at, _FONT, scale, _SHADE, width + 2, cv2.LINE_AA)
    cv2.putText(picture, text, at, _FONT, scale, ink, width, cv2.LINE_AA)
