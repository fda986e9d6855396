"""A reading drawn into its picture: balls where they are, the outline, the upright mark, text."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dr_eureka.game.state import all_states
from dr_eureka.vision.card_detections import SeenBall
from dr_eureka.vision.card_drawing import balls_in_image, draw_card_reading
from dr_eureka.vision.cards import CardReading, CardResult

CORNERS = np.array([(200.0, 150.0), (380.0, 170.0), (360.0, 350.0), (180.0, 330.0)])
GREY = np.full((480, 640, 3), 110, np.uint8)


def upright_balls(state):
    """Return the balls of an upright card, drawn to a rule."""
    return tuple(
        SeenBall(0.25 + 0.25 * tube, 0.8 - 0.11 * height, 0.11, colour, 0.9)
        for tube, balls in enumerate(str(state).split("|"))
        for height, colour in enumerate(balls)
    )


def reading(state="RGPR|GP|"):
    return CardReading(CardResult.OK, str(state), 0.93, "", CORNERS, upright_balls(state))


def test_balls_are_placed_in_the_picture_between_the_cards_corners():
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    homography = cv2.getPerspectiveTransform(square, CORNERS.astype(np.float32))
    for state in all_states()[::7]:
        expected = cv2.perspectiveTransform(np.array([[(ball.x, ball.y) for ball in upright_balls(state)]]), homography)[0]
        balls = balls_in_image(reading(state))
        np.testing.assert_allclose([(ball.x, ball.y) for ball in balls], expected, atol=1e-3)
        # The card is 181 px wide.
        np.testing.assert_allclose([ball.diameter for ball in balls], 0.11 * 181, rtol=0.03)


def test_the_picture_itself_is_left_alone_and_another_one_of_its_size_returned():
    before = GREY.copy()
    drawn = draw_card_reading(GREY, reading())
    np.testing.assert_array_equal(GREY, before)
    assert (drawn.shape, drawn.dtype) == (GREY.shape, np.uint8)


def test_outline_rings_and_the_mark_over_the_upper_side_are_drawn():
    drawn = draw_card_reading(GREY, reading())
    along_left_side = (CORNERS[0] + CORNERS[3]) / 2
    for x, y in (along_left_side, (CORNERS[0] + CORNERS[1]) / 2 - (0, 8)):
        assert tuple(drawn[round(y), round(x)]) == (60, 230, 60)
    ball = balls_in_image(reading())[0]
    edge = drawn[round(ball.y), round(ball.x - ball.diameter / 2) - 1 : round(ball.x - ball.diameter / 2) + 2]
    assert (255, 60, 60) in {tuple(pixel) for pixel in edge.tolist()}
    # Below the card there is no mark.
    assert (drawn[355:420, 180:380] == 110).all()


def test_the_straight_card_stands_in_the_upper_corner_away_from_the_card():
    for shift, corner in ((-100.0, (slice(2, 150), slice(-150, -2))), (200.0, (slice(2, 150), slice(2, 150)))):
        drawn = draw_card_reading(GREY, replace(reading(), corners=CORNERS + (shift, 0.0)))
        assert (drawn[corner] != 110).any()


def test_a_reading_without_a_card_gets_its_result_and_reason_as_text_only():
    drawn = draw_card_reading(GREY, CardReading(CardResult.NO_CARD, reason="no outline of a card"))
    assert (drawn[:400] == GREY[:400]).all()
    # Orange and white, as far as thin letters reach them.
    for ink in ((255, 150, 0), (255, 255, 255)):
        assert np.abs(drawn[430:].astype(int) - ink).max(axis=-1).min() < 60


@pytest.mark.parametrize("size", [(1, 1), (32, 32), (119, 4000), (3000, 4000)])
@pytest.mark.parametrize("result", [CardResult.OK, CardResult.SEVERAL_CARDS])
def test_any_size_of_picture_can_be_drawn_into(size, result):
    found = replace(reading(), result=result, reason="x" * 500)
    assert draw_card_reading(np.zeros((*size, 3), np.uint8), found).shape == (*size, 3)
