"""Pictures of cards are read as states, or refused by a named result."""
from dataclasses import replace

import cv2
import numpy as np
import pytest

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.aruco import marker_image
from dr_eureka.vision.card_network import CardNetwork
from dr_eureka.vision.card_renderer import draw_card, render_card
from dr_eureka.vision.card_scenes import paste_card
from dr_eureka.vision.card_views import ViewRanges, card_corners, degrade, sample_view
from dr_eureka.vision.cards import CardImageError, CardReader, CardResult, CardSettings

LIGHT = ViewRanges(
    side_px=((90, 200),), turn=((-0.35, 0.35),), tilt=((0.0, 0.35),), exposure=((0.8, 1.2),), motion_px=((1.0, 2.0),),
    noise=((0.0, 4.0),),
)


@pytest.fixture(scope="module")
def reader():
    return CardReader.load()


def table(level=110):
    return np.full((480, 640, 3), level, np.uint8)


def with_card(state, seed=0, centre=(320, 240), turn=0.0, side=120, image=None):
    """Return a picture of a card lying flat before the camera, and the card's corners."""
    image = table() if image is None else image
    ranges = replace(LIGHT, side_px=((side, side),), turn=((turn, turn),), tilt=((0.0, 0.0),))
    rng = np.random.default_rng(seed)
    corners = card_corners(sample_view(rng, ranges)) + centre
    paste_card(image, draw_card(state, rng, 384), corners)
    return image, corners


@pytest.mark.parametrize("state", ["RR|GG|PP", "RRGG||PP", "|RGPP|RG", "PRG|PRG|", "GPRP|R|G", "R|GG|PPR"])
def test_a_card_is_read_in_a_random_view(reader, state):
    rng = np.random.default_rng(sum(map(ord, state)))
    image = table()
    paste_card(image, draw_card(state, rng, 384), card_corners(sample_view(rng, LIGHT)) + (300, 220))
    reading = reader.read(degrade(image, sample_view(rng, LIGHT), rng))
    assert (reading.result, reading.state, reading.reason) == (CardResult.OK, state, "")
    assert 0.5 <= reading.confidence <= 1.0 and len(reading.balls) == 6


@pytest.mark.parametrize("quarter", range(4))
def test_whichever_side_is_down_the_corners_start_at_the_printed_upper_left(reader, quarter):
    image, corners = with_card("RGP|PG|R", 3, turn=quarter * np.pi / 2 + 0.1)
    reading = reader.read(image)
    assert reading.state == "RGP|PG|R"
    assert np.linalg.norm(reading.corners - corners, axis=1).max() < 4
    lowest = sorted(reading.balls, key=lambda ball: -ball.y)[:3]
    assert "".join(ball.colour for ball in sorted(lowest, key=lambda ball: ball.x)) == "RPR"


def test_pictures_without_a_card_say_so(reader):
    noise = np.random.default_rng(1).integers(0, 256, (480, 640, 3), np.uint8)
    for image in (table(0), table(255), table(), noise, np.zeros((1, 1, 3), np.uint8), np.zeros((3000, 4000, 3), np.uint8)):
        reading = reader.read(image)
        assert reading.result == CardResult.NO_CARD and reading.state is None and reading.reason


def test_markers_on_a_sheet_and_a_dark_screen_are_no_cards(reader):
    image = table(60)
    image[40:300, 40:600] = 250
    for number, column in enumerate((60, 200, 340, 480)):
        image[80:180, column:column + 100] = marker_image(number, 100)[..., None]
    image[320:460, 100:300] = 240
    image[330:450, 110:290] = 15
    assert reader.read(image).result == CardResult.NO_CARD
    image, _ = with_card("RG|GP|PR", 4, centre=(480, 390), image=image)
    assert reader.read(image).state == "RG|GP|PR"


def test_two_cards_are_several_even_when_they_show_the_same(reader):
    image, _ = with_card("RR|GG|PP", 1, centre=(180, 240))
    image, _ = with_card("RR|GG|PP", 2, centre=(460, 240), image=image)
    reading = reader.read(image)
    assert reading.result == CardResult.SEVERAL_CARDS and reading.state is None
    assert "2 cards seen" in reading.reason


@pytest.mark.parametrize("state", ["RR|GG|P", "RRR|GG|P", "RRR|GG|PP", "RR|RR|RR"])
def test_a_card_that_is_no_state_of_the_game_is_unreadable(reader, state):
    image, _ = with_card(state, 5)
    reading = reader.read(image)
    assert reading.result == CardResult.UNREADABLE and reading.state is None
    assert "ball" in reading.reason


def test_a_card_with_a_thumb_over_a_ball_is_unreadable(reader):
    rng = np.random.default_rng(6)
    drawing = draw_card("RRG|GP|P", rng, 384)
    ball = drawing.balls[2]
    cv2.circle(drawing.image, (int(ball.x), int(ball.y)), int(0.6 * ball.diameter), (205, 160, 135), -1)
    image = table()
    paste_card(image, drawing, np.array([(220, 140), (420, 140), (420, 340), (220, 340)], float))
    assert reader.read(image).result == CardResult.UNREADABLE


def test_a_large_photograph_is_read_and_its_corners_are_in_its_own_pixels(reader):
    image = np.full((3000, 4000, 3), 90, np.uint8)
    image[1000:2000, 1500:2500] = cv2.resize(render_card("PPRR|G|G", 7, 512), (1000, 1000))
    reading = reader.read(image)
    assert reading.state == "PPRR|G|G"
    assert reading.corners == pytest.approx(np.array([(1500, 1000), (2500, 1000), (2500, 2000), (1500, 2000)]), abs=25)


@pytest.mark.parametrize("picture", [
    np.zeros((480, 640), np.uint8), np.zeros((480, 640, 4), np.uint8), np.zeros((480, 640, 3), np.float32), None,
])
def test_what_is_no_rgb_picture_is_refused(reader, picture):
    with pytest.raises(CardImageError, match="expected uint8 RGB"):
        reader.read(picture)


def test_reading_leaves_the_picture_as_it_was_and_is_repeatable(reader):
    image, _ = with_card("RR|GG|PP", 8)
    before = image.copy()
    first, second = reader.read(image), reader.read(image)
    assert np.array_equal(image, before)
    assert (first.state, first.confidence) == (second.state, second.confidence)


@pytest.mark.parametrize("sure_confidence, looks", [(0.5, 1), (1.0, 2)])
def test_a_card_beyond_doubt_is_looked_at_once_and_any_other_twice(monkeypatch, sure_confidence, looks):
    crops, detect = [], CardNetwork.detect
    monkeypatch.setattr(CardNetwork, "detect", lambda self, crop: crops.append(crop) or detect(self, crop))
    image, _ = with_card("RGP|PG|R", 3)
    reading = CardReader.load(replace(CardSettings.load(), sure_confidence=sure_confidence)).read(image)
    assert (reading.state, len(crops)) == ("RGP|PG|R", looks)


def test_missing_weights_are_named():
    with pytest.raises(DrEurekaError, match="no_such.npz"):
        CardReader.load(replace(CardSettings.load(), weights="no_such.npz"))
