"""A state drawn in plain text, for people at a terminal."""
from __future__ import annotations

from dr_eureka.game.state import TUBE_CAPACITY, TUBES, State

_COLUMN_WIDTH = 9


def draw_state(state: State) -> str:
    """Draw the three tubes side by side, the lowest balls in the lowest line, with the tubes' names below."""
    levels = range(TUBE_CAPACITY - 1, -1, -1)
    rows = [[f"| {balls[level : level + 1]:1} |" for balls in state.tubes] for level in levels]
    rows.append(["+---+"] * len(TUBES))
    rows.append(list(TUBES))
    return "\n".join("".join(cell.center(_COLUMN_WIDTH) for cell in row).rstrip() for row in rows)
