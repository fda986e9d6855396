"""Pours turned into what two hands do: pick, pour and place (paper, section 3.5)."""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Optional

from dr_eureka.game.hands import HANDS, Reach, grip_for
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.game.state import Pour


@dataclass(frozen=True)
class Action:
    """One thing a hand does.

    `kind` is "pick" (take `tube` from the table with `hand`), "place" (put it back) or "pour" (from `tube` in `hand`
    into `target_tube` in `target_hand`, `count` balls). The target fields are None and `count` is 0 unless it pours.
    """

    kind: str
    hand: str
    tube: str
    target_tube: Optional[str] = None
    target_hand: Optional[str] = None
    count: int = 0

    def __str__(self) -> str:
        if self.kind == "pour":
            balls = "1 ball" if self.count == 1 else f"{self.count} balls"
            source = f"{self.tube} tube ({self.hand} hand)"
            target = f"{self.target_tube} tube ({self.target_hand} hand)"
            return f"pour {balls} from the {source} into the {target}"
        return f"{self.kind} the {self.tube} tube with the {self.hand} hand"


def actions_for(pours: Iterable[Pour], reach: Optional[Reach] = None) -> tuple[Action, ...]:
    """List the actions that carry out the pours and leave every tube on the table.

    A tube that the same hand needs for the following pour stays in that hand. `reach` is the robot's own by default,
    as config/planner.yaml tells it.

    Raises:
        ReachError: when the hands cannot take the two tubes of a pour.
    """
    return without_regrasps(separate_actions(pours, reach))


def separate_actions(pours: Iterable[Pour], reach: Optional[Reach] = None) -> tuple[Action, ...]:
    """List the actions when every pour picks both its tubes and places them again.

    Raises:
        ReachError: when the hands cannot take the two tubes of a pour.
    """
    reach = load_planner_settings().reach if reach is None else reach
    actions: list[Action] = []
    for pour in pours:
        grip = grip_for(pour, reach)
        held = tuple(zip(HANDS, grip))
        actions += [Action("pick", hand, tube) for hand, tube in held]
        actions.append(
            Action(
                "pour",
                grip.hand_with(pour.source),
                pour.source,
                pour.target,
                grip.hand_with(pour.target),
                pour.count,
            )
        )
        actions += [Action("place", hand, tube) for hand, tube in held]
    return tuple(actions)


def without_regrasps(actions: Sequence[Action]) -> tuple[Action, ...]:
    """Drop each place that is followed by a pick of the same tube with the same hand, and that pick (paper, 3.5)."""
    kept: list[Optional[Action]] = []
    last_of_hand: dict[str, int] = {}
    for action in actions:
        previous = last_of_hand.get(action.hand)
        if action.kind == "pick" and previous is not None:
            if kept[previous] == Action("place", action.hand, action.tube):
                kept[previous] = None
                continue
        hands = (action.hand,) if action.target_hand is None else (action.hand, action.target_hand)
        last_of_hand.update(dict.fromkeys(hands, len(kept)))
        kept.append(action)
    return tuple(action for action in kept if action is not None)
