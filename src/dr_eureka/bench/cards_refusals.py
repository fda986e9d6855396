"""What the card reader makes of pictures that it must not read as something else.

Four kinds: cards that no state of the game looks like, cards with balls covered, cards cut off by the picture's edge, and
two cards at once. Reading what is there is right, refusing is never wrong, and reporting another state is.
"""

from __future__ import annotations

from collections import Counter

import cv2
import numpy as np

from dr_eureka.bench.cards_states import ASKED_VIEWS, STATES
from dr_eureka.bench.report import Row, progress, share_row
from dr_eureka.game.state import COLOURS
from dr_eureka.vision.card_renderer import CardDrawing, draw_card
from dr_eureka.vision.card_scenes import clutter, paste_card
from dr_eureka.vision.card_style import sample_style
from dr_eureka.vision.card_views import card_corners, degrade, sample_view
from dr_eureka.vision.cards import CardReader, CardResult

REFUSALS = 300  # scenes of each kind
KINDS = ("impossible card", "covered balls", "cut off", "two cards")
MOST_WRONG = 0.0005
_PICTURE_PX = np.array((640, 480))
_TEXTURE_PX = 384
_SCENES = 102  # what random numbers are for: each use has its own


def refusal_rows(seed: int, count: int) -> list[Row]:
    """Return, for each kind, the share of scenes read as what is not there (judged), and of those refused."""
    reader, rows, wrong = CardReader.load(), [], 0
    for kind in KINDS:
        outcomes: Counter[str] = Counter()
        for index in progress(range(count), count, f"cards, {kind}"):
            image, shown = refusal_scene(kind, seed, index)
            reading = reader.read(image)
            ok = reading.result == CardResult.OK
            outcomes["refused" if not ok else "right" if reading.state in shown else "wrong"] += 1
        wrong += outcomes["wrong"]
        rows.append(share_row(f"{kind}: refused", outcomes["refused"], count))
        rows.append(share_row(f"{kind}: OK and wrong", outcomes["wrong"], count))
    most = MOST_WRONG * len(KINDS) * count
    return rows + [share_row("must not be read: OK and wrong", wrong, len(KINDS) * count, goal=f"<= {MOST_WRONG}", ok=wrong <= most)]


def refusal_scene(kind: str, seed: int, index: int) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return a picture (480, 640, 3) uint8 RGB of a kind and the states that may be read in it; fixed by the arguments."""
    rng = np.random.default_rng((seed, _SCENES, KINDS.index(kind), index))
    image = clutter(rng, *(int(length) for length in _PICTURE_PX), int(rng.integers(0, 12)))
    state = _impossible_state(rng) if kind == "impossible card" else str(rng.choice(STATES))
    drawing, view = draw_card(state, rng, _TEXTURE_PX, sample_style(rng)), sample_view(rng, ASKED_VIEWS)
    corners = _somewhere(rng, card_corners(view), cut_off=kind == "cut off")
    if kind == "covered balls":
        _cover(rng, drawing)
    shown = (state,) if state in STATES else ()
    if kind == "two cards":
        other = str(rng.choice(STATES))
        paste_card(image, draw_card(other, rng, _TEXTURE_PX, sample_style(rng)), _apart_from(rng, corners))
        shown += (other,)
    paste_card(image, drawing, corners)
    return degrade(image, view, rng), shown


def _impossible_state(rng: np.random.Generator) -> str:
    """Return what can be drawn but is no state: a possible one with a ball taken out, recoloured or added, or balls at random."""
    while True:
        if rng.random() < 0.5:
            tubes = ["".join(rng.choice(list(COLOURS), rng.integers(5))) for _ in range(3)]
        else:
            tubes = str(rng.choice(STATES)).split("|")
            tube = int(rng.integers(3))
            at = int(rng.integers(len(tubes[tube]) + 1))
            # nothing, another ball or one more in place of the ball there
            put, taken = str(rng.choice(["", *COLOURS])), int(rng.integers(2))
            tubes[tube] = tubes[tube][:at] + put + tubes[tube][at + taken:]
        if max(map(len, tubes)) <= 4 and "|".join(tubes) not in STATES:
            return "|".join(tubes)


def _somewhere(rng: np.random.Generator, corners: np.ndarray, cut_off: bool) -> np.ndarray:
    """Return a card's corners (4, 2) [px] moved to a random place in the picture, or over one of its edges by up to 45 %."""
    low, span = corners.min(0) - 1, np.ptp(corners, axis=0) + 2
    room = np.maximum(_PICTURE_PX - span, 0)
    place = rng.uniform(0, 1, 2) * room
    if cut_off:
        side, beyond = int(rng.integers(2)), rng.uniform(0.0, 0.45)
        place[side] = -beyond * span[side] if rng.random() < 0.5 else room[side] + beyond * span[side]
    return corners - low + place


def _apart_from(rng: np.random.Generator, corners: np.ndarray) -> np.ndarray:
    """Return the corners of another card that does not overlap the first, or hardly, where it leaves no room."""
    for _ in range(200):
        other = _somewhere(rng, card_corners(sample_view(rng, ASKED_VIEWS)), cut_off=False)
        if cv2.intersectConvexConvex(corners.astype(np.float32), other.astype(np.float32))[0] == 0:
            break
    return other


def _cover(rng: np.random.Generator, drawing: CardDrawing) -> None:
    """Lay one or two blobs, of skin or of any other colour, over balls of a drawing, in place."""
    skin = ((205, 160, 135), (120, 80, 60))
    for _ in range(int(rng.integers(1, 3))):
        ball = drawing.balls[rng.integers(len(drawing.balls))]
        centre = np.array((ball.x, ball.y)) + rng.normal(0, 0.5, 2) * ball.diameter
        axes = rng.uniform((0.4, 0.3), (1.2, 0.8)) * ball.diameter
        colour = skin[rng.integers(2)] if rng.random() < 0.5 else rng.integers(0, 256, 3)
        box = (tuple(centre), tuple(2 * axes), rng.uniform(0, 180))
        cv2.ellipse(drawing.image, box, tuple(int(level) for level in colour), -1, cv2.LINE_AA)
