"""The person who shows cards to the simulated robot."""

from dr_eureka.game.state import START, State
from dr_eureka.simulation.card_holder import CardHolder

GIVEN = State.parse("RRGG||PP")


def test_a_card_is_shown_once_when_the_robot_looks_and_taken_away_after():
    holder = CardHolder(seed=1, first=GIVEN)
    assert holder.follow(False, 0, START) is None
    assert holder.follow(True, 0, START).state == GIVEN
    assert holder.follow(True, 0, START) is None
    assert holder.follow(False, 0, START).state is None
    assert holder.follow(False, 0, START) is None


def test_the_next_game_gets_a_card_of_its_own():
    holder = CardHolder(seed=1, first=GIVEN)
    holder.follow(True, 0, START)
    holder.follow(False, 0, START)
    second = holder.follow(True, 1, GIVEN)
    assert second.number == 1 and second.state not in (None, GIVEN)


def test_equal_seeds_draw_equal_cards_and_different_seeds_hardly_ever():
    cards = [CardHolder(seed, None).card(0, START) for seed in range(40)]
    assert cards == [CardHolder(seed, None).card(0, START) for seed in range(40)]
    assert len(set(cards)) > 30


def test_no_card_shows_what_the_tubes_hold_already():
    assert all(CardHolder(seed, None).card(3, GIVEN) != GIVEN for seed in range(300))
