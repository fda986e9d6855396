"""Balls on a card become tubes, at every spacing and whichever side is down, or are refused."""
from itertools import product

import cv2
import numpy as np
import pytest

from dr_eureka.game.state import State, all_states
from dr_eureka.vision.card_colours import ODD, PLAIN, oddest_ball
from dr_eureka.vision.card_detections import CropDetections, SeenBall, SeenFoot
from dr_eureka.vision.card_layout import LayoutError, columns, read_layout, turned
from dr_eureka.vision.card_renderer import BALL_COLOURS, lay_out
from dr_eureka.vision.card_style import sample_style

JITTER = 3 / 416  # [fraction of the crop]


def seen_card(state, rng, turn=0, feet=(0, 1, 2), jitter=JITTER, look="training"):
    """Return what a perfect detector would see of a drawn card, shaken by up to `jitter`, upright after `turn` turns."""
    drawn_balls, drawn_feet = lay_out(str(state), rng, sample_style(rng, look), 1.0)
    shake = lambda: rng.uniform(-jitter, jitter)
    balls = [SeenBall(b.x + shake(), b.y + shake(), b.diameter, b.colour, 0.99) for b in drawn_balls]
    stands = [SeenFoot(x + shake(), y + shake(), 0.99) for x, y in drawn_feet[list(feet)]]
    return CropDetections(tuple(turned(b, -turn) for b in balls), tuple(turned(f, -turn) for f in stands))


def test_every_state_is_read_at_random_spacing_and_turn_in_spite_of_three_pixels_of_jitter():
    rng = np.random.default_rng(1)
    for number, state in enumerate(all_states()):
        layout = read_layout(seen_card(state, rng, turn=number % 4))
        assert (layout.state, layout.turn) == (state, number % 4)


def test_with_one_foot_hidden_a_state_is_read_unless_it_is_the_foot_of_an_empty_tube():
    rng = np.random.default_rng(2)
    for number, state in enumerate(all_states()[::9]):
        hidden = number % 3
        seen = seen_card(state, rng, feet=[i for i in range(3) if i != hidden])
        if state.tubes[hidden]:
            assert read_layout(seen).state == state
        else:
            with pytest.raises(LayoutError, match="which tube is empty cannot be told|no way up"):
                read_layout(seen)


def test_without_feet_a_card_that_also_reads_upside_down_is_refused():
    rng = np.random.default_rng(3)
    with pytest.raises(LayoutError, match="which way is up"):
        read_layout(seen_card("RG|GP|PR", rng, feet=()))


@pytest.mark.parametrize("spacing_px", [70, 82, 95, 100, 130])
@pytest.mark.parametrize("empty", [0, 1, 2])
def test_the_empty_tube_is_told_at_every_spacing_also_where_the_authors_rule_fails(spacing_px, empty):
    spacing, diameter = spacing_px / 416, 52 / 416
    contents = ["RGP", "PGR"]
    contents.insert(empty, "")
    balls, feet = [], []
    for tube, colours in enumerate(contents):
        x = 0.5 + (tube - 1) * spacing
        feet.append(SeenFoot(x, 0.8, 0.9))
        balls += [SeenBall(x, 0.8 - diameter * (0.56 + i), diameter, c, 0.9) for i, c in enumerate(colours)]
    assert str(read_layout(CropDetections(tuple(balls), tuple(feet))).state) == "|".join(contents)


def test_k_means_on_one_axis_finds_the_best_of_all_assignments():
    rng = np.random.default_rng(4)
    for _ in range(10):
        x = rng.uniform(0, 1, 6)
        best = min(
            (sum(x[np.array(labels) == k].var() * labels.count(k) for k in set(labels)), labels)
            for labels in product(range(3), repeat=6) if len(set(labels)) == 3
        )[1]
        expected = {tuple(i for i in range(6) if best[i] == k) for k in range(3)}
        assert {tuple(sorted(cluster)) for cluster in columns(list(x), ball_diameter=1e-9)} == expected


def test_clusters_of_one_tube_are_merged_and_neighbouring_tubes_are_not():
    in_two_tubes = [0.30, 0.301, 0.299, 0.45, 0.449, 0.451]
    assert [len(c) for c in columns(in_two_tubes, ball_diameter=0.13)] == [3, 3]
    assert [len(c) for c in columns([0.3, 0.3, 0.45, 0.45, 0.6, 0.6], ball_diameter=0.13)] == [2, 2, 2]


@pytest.mark.parametrize("state, reason", [
    ("RR|GG|P", "5 balls seen, expected 6"),
    ("RRR|GG|PP", "7 balls seen, expected 6"),
    ("RRR|GG|P", "3 red balls"),
])
def test_what_cannot_be_a_card_is_refused_with_what_was_seen(state, reason):
    with pytest.raises(LayoutError, match=reason):
        read_layout(seen_card(state, np.random.default_rng(5)))


def test_a_ball_in_the_air_is_refused():
    seen = seen_card("RRGG|P|P", np.random.default_rng(6), jitter=0)
    top = min(seen.balls, key=lambda ball: ball.y)
    lifted = SeenBall(top.x, top.y - 0.6 * top.diameter, top.diameter, top.colour, 0.9)
    balls = tuple(lifted if ball is top else ball for ball in seen.balls)
    with pytest.raises(LayoutError, match="no way up"):
        read_layout(CropDetections(balls, seen.feet))


def test_a_foot_beside_the_columns_is_refused():
    seen = seen_card("RG|GP|PR", np.random.default_rng(7), jitter=0)
    first, *others = sorted(seen.feet, key=lambda foot: foot.x)
    moved = SeenFoot((first.x + others[0].x) / 2, first.y, 0.9)
    with pytest.raises(LayoutError, match="no way up"):
        read_layout(CropDetections(seen.balls, (moved, *others)))


def test_four_quarter_turns_bring_a_ball_back():
    ball = SeenBall(0.2, 0.3, 0.1, "R", 0.9)
    assert (turned(ball, 1).x, turned(ball, 1).y) == (0.7, 0.2)
    back = turned(ball, 4)
    assert (back.x, back.y) == pytest.approx((0.2, 0.3))


def test_states_are_the_games_own():
    layout = read_layout(seen_card("RRGG||PP", np.random.default_rng(8)))
    assert isinstance(layout.state, State)


def painted(balls, paint):
    """Return a crop with a disc of the given RGB at each ball."""
    crop = np.full((100, 100, 3), 20, np.uint8)
    for ball, rgb in zip(balls, paint):
        cv2.circle(crop, (int(100 * ball.x), int(100 * ball.y)), int(50 * ball.diameter), rgb, -1)
    return crop


def test_a_ball_that_looks_unlike_its_own_colour_is_odd_and_even_light_makes_none_odd():
    balls = seen_card("RG|RG|PP", np.random.default_rng(9), jitter=0).balls
    paint = [BALL_COLOURS[ball.colour][0] for ball in balls]
    for light in (0.3, 1.0):
        assert oddest_ball(painted(balls, [tuple(light * v for v in rgb) for rgb in paint]), balls)[1] < PLAIN
    paint[1] = BALL_COLOURS["P"][0]  # taken for green, looks purple
    ball, oddity = oddest_ball(painted(balls, paint), balls)
    assert ball.colour in "GP" and oddity > ODD
