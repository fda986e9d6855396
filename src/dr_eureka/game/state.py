"""The puzzle as a value: three tubes, six balls, and the pours between them (paper, section 3.3)."""
from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations, product

from dr_eureka.errors import DrEurekaError

TUBES = ("left", "center", "right")
COLOURS = "RGP"
COLOUR_NAMES = {"R": "red", "G": "green", "P": "purple"}
BALLS_PER_COLOUR = 2
TUBE_CAPACITY = 4
# Of a drawn tube with the room beside it, in characters.
_COLUMN_WIDTH = 9


class StateError(DrEurekaError):
    """A text or a set of tubes that is no state of the game.

    Attributes:
        state: what was given, as text.
    """

    def __init__(self, state: str, reason: str) -> None:
        # A goal may come from a command line or a launch file: keep the message on one readable line.
        shown = state if state.isprintable() and state else repr(state)
        if len(shown) > 60:
            shown = f"{shown[:57]}..."
        super().__init__(f"{shown}: {reason}")
        self.state = state


class PourError(DrEurekaError):
    """A pour that names no two tubes or that a state does not allow.

    Attributes:
        pour: the refused pour.
    """

    def __init__(self, pour: Pour, reason: str) -> None:
        super().__init__(f"pour {pour}: {reason}")
        self.pour = pour


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


@dataclass(frozen=True, order=True)
class Pour:
    """Pour the uppermost `count` balls of one tube into another.

    The balls leave one after another, so several of them arrive in reversed order.

    Raises:
        PourError: for an unknown tube, twice the same tube, or a count that is no positive whole number.
    """

    source: str
    target: str
    count: int = 1

    def __post_init__(self) -> None:
        for tube in (self.source, self.target):
            if tube not in TUBES:
                raise PourError(self, f"unknown tube {tube!r}, expected one of {', '.join(TUBES)}")
        if self.source == self.target:
            raise PourError(self, "source and target are the same tube, expected two")
        if isinstance(self.count, bool) or not isinstance(self.count, int) or self.count < 1:
            raise PourError(self, f"count is {self.count!r}, expected a whole number of at least 1")

    def __str__(self) -> str:
        return f"{self.source} to {self.target}, count {self.count}"


@dataclass(frozen=True, order=True)
class State:
    """Which balls are in which tube, written `RR|GG|PP`.

    `tubes` has one string a tube, left to right as the robot sees them, balls bottom to top, one letter of
    `COLOURS` each. Only states of the game can be built: two balls of each colour, at most four in a tube.

    Raises:
        StateError: naming what is wrong with the tubes.
    """

    tubes: tuple[str, str, str]

    def __post_init__(self) -> None:
        text = "|".join(self.tubes)
        if len(self.tubes) != len(TUBES):
            raise StateError(text, f"{_counted(len(self.tubes), 'tube')}, expected {len(TUBES)} separated by '|'")
        for name, balls in zip(TUBES, self.tubes):
            for ball in balls:
                if ball not in COLOUR_NAMES:
                    raise StateError(text, f"unknown ball {ball!r} in the {name} tube, expected only R, G and P")
        counts = Counter("".join(self.tubes))
        for colour, name in COLOUR_NAMES.items():
            if counts[colour] != BALLS_PER_COLOUR:
                raise StateError(text, f"{_counted(counts[colour], f'{name} ball')}, expected {BALLS_PER_COLOUR}")
        for name, balls in zip(TUBES, self.tubes):
            if len(balls) > TUBE_CAPACITY:
                raise StateError(text, f"{len(balls)} balls in the {name} tube, at most {TUBE_CAPACITY} fit")

    @classmethod
    def parse(cls, text: str) -> State:
        """Read a state written like `RR|GG|PP` or, with an empty tube, `RRGG||PP`.

        Raises:
            StateError: in one line, what is wrong with the text.
        """
        if not isinstance(text, str):
            raise StateError(repr(text), "not a text, expected a state such as RR|GG|PP")
        return cls(tuple(text.split("|")))

    def __str__(self) -> str:
        return "|".join(self.tubes)

    def tube(self, name: str) -> str:
        """Return the balls of the named tube, bottom to top."""
        return self.tubes[TUBES.index(name)]

    def after(self, pour: Pour) -> State:
        """Return the state that a pour leads to.

        Raises:
            PourError: when the source has too few balls or the target too little room.
        """
        source, target = self.tube(pour.source), self.tube(pour.target)
        if pour.count > len(source):
            raise PourError(pour, f"{_counted(len(source), 'ball')} in the {pour.source} tube of {self}")
        if len(target) + pour.count > TUBE_CAPACITY:
            raise PourError(
                pour,
                f"{_counted(len(target), 'ball')} in the {pour.target} tube of {self}, at most {TUBE_CAPACITY} fit",
            )
        kept, poured = source[: -pour.count], source[-pour.count :]
        changed = {pour.source: kept, pour.target: target + poured[::-1]}
        return State(tuple(changed.get(name, balls) for name, balls in zip(TUBES, self.tubes)))

    def legal_pours(self, max_count: int = 1) -> tuple[Pour, ...]:
        """List the pours of up to `max_count` balls that this state allows, in the order of `TUBES`."""
        return tuple(
            Pour(source, target, count)
            for source, target in permutations(TUBES, 2)
            for count in range(
                1, min(max_count, len(self.tube(source)), TUBE_CAPACITY - len(self.tube(target))) + 1
            )
        )


START = State(("RR", "GG", "PP"))


@lru_cache(maxsize=1)
def all_states() -> tuple[State, ...]:
    """Return every state of the game, sorted: 19 ways to fill the tubes times 90 orders of the colours, 1710."""
    ball_count = BALLS_PER_COLOUR * len(COLOURS)
    orders = sorted(set(permutations(COLOURS * BALLS_PER_COLOUR)))
    fillings = [
        (left, center)
        for left, center in product(range(TUBE_CAPACITY + 1), repeat=2)
        if 0 <= ball_count - left - center <= TUBE_CAPACITY
    ]
    return tuple(
        sorted(
            State((text[:left], text[left : left + center], text[left + center :]))
            for text in map("".join, orders)
            for left, center in fillings
        )
    )


def draw_state(state: State) -> str:
    """Draw the three tubes side by side in text, the lowest balls in the lowest line, with the tubes' names below."""
    levels = range(TUBE_CAPACITY - 1, -1, -1)
    rows = [[f"| {balls[level : level + 1]:1} |" for balls in state.tubes] for level in levels]
    rows.append(["+---+"] * len(TUBES))
    rows.append(list(TUBES))
    return "\n".join("".join(cell.center(_COLUMN_WIDTH) for cell in row).rstrip() for row in rows)
