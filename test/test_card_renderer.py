"""Cards are drawn as they look, repeatably, with balls where the drawing says."""
import numpy as np
import pytest

from dr_eureka.vision.card_renderer import (
    BALL_COLOURS, CardRenderError, draw_card, render_card,
)
from dr_eureka.vision.card_style import sample_style


def test_equal_seeds_give_equal_cards_and_other_seeds_give_others():
    assert np.array_equal(render_card("RR|GG|PP", 3, 64), render_card("RR|GG|PP", 3, 64))
    assert not np.array_equal(render_card("RR|GG|PP", 3, 64), render_card("RR|GG|PP", 4, 64))


def test_a_card_is_black_inside_a_white_border():
    card = render_card("RRGG||PP", 1, 200)
    assert card.shape == (200, 200, 3) and card.dtype == np.uint8
    for edge in (card[4, 40:160], card[-5, 40:160], card[40:160, 4], card[40:160, -5]):
        assert edge.min() > 235
    assert np.median(card[20:180, 20:180]) < 60


@pytest.mark.parametrize("look", ["real", "training", "held_out"])
def test_each_ball_shows_its_colour_where_the_drawing_says(look):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        drawing = draw_card("RGPG|P|R", rng, 160, sample_style(rng, look))
        for ball in drawing.balls:
            pixel = drawing.image[round(ball.y), round(ball.x)].astype(int)
            nearest = min(BALL_COLOURS, key=lambda c: np.abs(np.array(BALL_COLOURS[c][0]) - pixel).sum())
            assert nearest == ball.colour


def test_all_balls_and_feet_lie_inside_the_border_and_feet_below_the_balls():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        drawing = draw_card("RGPG|PR|", rng, 100, sample_style(rng, "training"))
        border = 100 * drawing.style.border
        for ball in drawing.balls:
            assert border < ball.x - ball.diameter / 2 and ball.x + ball.diameter / 2 < 100 - border
            assert border < ball.y - ball.diameter / 2 and ball.y < drawing.feet[ball.tube, 1]
            assert abs(ball.x - drawing.feet[ball.tube, 0]) < 0.2 * ball.diameter
        assert np.all(drawing.feet < 100 - border)


def test_the_spacing_of_the_tubes_varies_from_card_to_card():
    spacings = [sample_style(np.random.default_rng(seed)).tube_spacing for seed in range(50)]
    assert min(spacings) < 0.235 and max(spacings) > 0.27


@pytest.mark.parametrize("state", ["RR|GG", "RRRRR|G|", "RR|GG|XX", "", "RR|GG|PP|"])
def test_a_card_that_cannot_be_drawn_is_refused_by_name(state):
    with pytest.raises(CardRenderError, match="three tubes"):
        render_card(state, 1, 64)


def test_a_card_without_pixels_is_refused():
    with pytest.raises(CardRenderError, match="side 0 px"):
        render_card("RR|GG|PP", 1, 0)
