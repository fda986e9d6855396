"""Actions of the two hands, checked by a referee that plays them out on a table of its own."""
import pytest

from dr_eureka.game.actions import Action, actions_for, separate_actions, without_regrasps
from dr_eureka.game.hands import EMPTY_GRIP, Grip, ReachError, grip_for, handling_between
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.game.state import START, Pour, State, all_states


REACH = load_planner_settings().reach


def play_out(actions, start):
    """Carry out actions on a table with two hands and return the state at the end; refuse the impossible."""
    state, held, on_table = start, {"left": None, "right": None}, {"left", "center", "right"}
    for action in actions:
        if action.kind == "pick":
            assert held[action.hand] is None and action.tube in on_table
            held[action.hand] = action.tube
            on_table.remove(action.tube)
        elif action.kind == "place":
            assert held[action.hand] == action.tube
            held[action.hand] = None
            on_table.add(action.tube)
        else:
            assert action.kind == "pour" and action.hand != action.target_hand
            assert held[action.hand] == action.tube and held[action.target_hand] == action.target_tube
            state = state.after(Pour(action.tube, action.target_tube, action.count))
    assert on_table == {"left", "center", "right"}
    return state


def text(actions):
    return [str(action) for action in actions]


@pytest.mark.parametrize("make", [actions_for, separate_actions])
def test_the_actions_of_every_plan_can_be_carried_out_and_reach_the_goal(make):
    for goal in all_states()[::3]:
        assert play_out(make(plan_pours(START, goal)), START) == goal


@pytest.mark.parametrize(
    "pour, grip",
    [
        (Pour("left", "center"), Grip("left", "center")),
        (Pour("center", "left"), Grip("left", "center")),
        (Pour("left", "right"), Grip("left", "right")),
        (Pour("right", "center"), Grip("center", "right")),
    ],
)
def test_the_left_hand_holds_the_tube_further_left(pour, grip):
    assert grip_for(pour, REACH) == grip


def test_crossed_hands_are_taken_only_when_reach_leaves_no_other_choice():
    anything = {"left": ("left", "center", "right"), "right": ("left", "center", "right")}
    assert grip_for(Pour("right", "left"), anything) == Grip("left", "right")
    crossed = {"left": ("center", "right"), "right": ("left", "center")}
    assert grip_for(Pour("left", "center"), crossed) == Grip("center", "left")


def test_a_pair_out_of_reach_is_named():
    with pytest.raises(ReachError) as caught:
        actions_for([Pour("left", "right")], reach={"left": ("left", "center"), "right": ("center",)})
    assert str(caught.value) == (
        "pour left to right, count 1: the hands cannot take the tubes for this, "
        "they reach left hand: left, center; right hand: center"
    )


def test_a_single_pour_picks_both_tubes_pours_and_places_both():
    assert text(actions_for([Pour("right", "center")])) == [
        "pick the center tube with the left hand",
        "pick the right tube with the right hand",
        "pour 1 ball from the right tube (right hand) into the center tube (left hand)",
        "place the center tube with the left hand",
        "place the right tube with the right hand",
    ]


def test_two_pours_between_the_same_tubes_keep_both_in_the_hands():
    kinds = [action.kind for action in actions_for([Pour("left", "center"), Pour("center", "left")])]
    assert kinds == ["pick", "pick", "pour", "pour", "place", "place"]


def test_a_tube_that_stays_in_its_hand_is_not_regrasped_while_the_other_hand_changes():
    actions = actions_for([Pour("left", "right"), Pour("right", "center", 2)])
    assert text(actions[2:6]) == [
        "pour 1 ball from the left tube (left hand) into the right tube (right hand)",
        "place the left tube with the left hand",
        "pick the center tube with the left hand",
        "pour 2 balls from the right tube (right hand) into the center tube (left hand)",
    ]


def test_a_tube_that_changes_hands_is_placed_before_the_other_hand_picks_it():
    actions = text(actions_for([Pour("left", "center"), Pour("center", "right")]))
    assert actions.index("place the center tube with the right hand") < actions.index(
        "pick the center tube with the left hand"
    )


def test_a_place_is_kept_when_another_hand_or_tube_follows():
    actions = (
        Action("place", "left", "left"),
        Action("pick", "left", "center"),
        Action("place", "left", "center"),
        Action("pick", "right", "center"),
    )
    assert without_regrasps(actions) == actions


def test_handling_between_grips_counts_what_the_actions_count():
    for goal in all_states()[::50]:
        pours = plan_pours(START, goal)
        grips = [EMPTY_GRIP, *(grip_for(pour, REACH) for pour in pours), EMPTY_GRIP]
        expected = sum(action.kind != "pour" for action in actions_for(pours))
        assert sum(map(handling_between, grips, grips[1:])) == expected


def test_no_pours_need_no_actions():
    assert actions_for([]) == ()


def test_the_grip_tells_which_hand_has_a_tube():
    assert grip_for(Pour("left", "center"), REACH).hand_with("center") == "right"


def test_a_state_of_another_start_can_be_reached_too():
    start, goal = State.parse("RGPR||GP"), State.parse("P|GRPG|R")
    assert play_out(actions_for(plan_pours(start, goal)), start) == goal
