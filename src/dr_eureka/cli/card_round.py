"""One card as a person plays it: pours, undo, restart, each with its time."""
from __future__ import annotations

from collections.abc import Callable

from dr_eureka.bench.human_cards import Card
from dr_eureka.bench.people import Move, PlayedCard
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import Pour


class NothingToUndo(DrEurekaError):
    """There is no pour to take back."""


class CardRound:
    """The tubes while a person plays a card.

    With real tubes a ball that was poured wrongly has to be poured back. So has it here: undo and restart are pours, and
    cost as many.

    Attributes:
        card: what is played.
        state: what the tubes hold now.
        moves: every pour so far, those that took others back included.
    """

    def __init__(self, card: Card, began: str, clock: Callable[[], float]) -> None:
        """Show a card; `began` is the time of day in ISO 8601, `clock` returns seconds and never runs back."""
        self.card = card
        self.state = card.start
        self.moves: list[Move] = []
        self._began = began
        self._clock = clock
        self._shown_at = clock()
        self._standing: list[Pour] = []

    @property
    def solved(self) -> bool:
        """Whether the tubes are as on the card."""
        return self.state == self.card.goal

    @property
    def seconds(self) -> float:
        """Seconds since the card was shown; once it is solved, until it was."""
        return self.moves[-1].seconds if self.solved and self.moves else self._clock() - self._shown_at

    def pour(self, source: str, target: str) -> None:
        """Pour one ball. Raises PourError for a pour that the tubes do not allow, and leaves them as they are."""
        pour = Pour(source, target)
        self._move(pour, undo=False)
        self._standing.append(pour)

    def undo(self) -> None:
        """Pour the last ball back. Raises NothingToUndo when the tubes are as at the start."""
        if not self._standing:
            raise NothingToUndo("nothing to undo, the tubes are as at the start")
        pour = self._standing.pop()
        self._move(Pour(pour.target, pour.source), undo=True)

    def restart(self) -> None:
        """Pour all balls back, the last first. Raises NothingToUndo when the tubes are as at the start."""
        self.undo()
        while self._standing:
            self.undo()

    def played(self) -> PlayedCard:
        """Return what was played so far, for the log."""
        return PlayedCard(
            began=self._began,
            start=str(self.card.start),
            goal=str(self.card.goal),
            optimum=self.card.optimum,
            solved=self.solved,
            seconds=round(self.seconds, 3),
            moves=tuple(self.moves),
        )

    def _move(self, pour: Pour, undo: bool) -> None:
        self.state = self.state.after(pour)
        self.moves.append(Move(round(self._clock() - self._shown_at, 3), pour.source, pour.target, undo))
