"""The planner against a person (paper, section 4.2): Figures 16 and 17 with the model of the short-sighted player.

The person is the model of `game.human`; cards that real people played are shown beside it when the folder of plots holds
logs of `play_human`, any file `*.jsonl`. The paper prints no figures, only what it saw in them.
"""
from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from dr_eureka.bench.human_cards import Card, Contest, draw_cards, optima
from dr_eureka.bench.people import PlayedCard, read_played_cards
from dr_eureka.bench.report import CONFIDENCE, BenchOptions, Row, mean_row, progress, share_row
from dr_eureka.game.human import human_pours, lifts_settled
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import START, all_states

#: Starts for each number of pours, as in the paper's Figure 17.
STARTS_EACH = 10
#: From here on the paper saw the person fall behind.
HARD_FROM = 7
#: Our reading of "comparable": less than this many pours above the optimum on average.
COMPARABLE_EXTRA = 0.5
#: Figure 16: fewest pours of the simple and of the complex card, and runs of which the median is shown.
SIMPLE, COMPLEX = 5, 12
RUNS = 21


def run(options: BenchOptions) -> list[Row]:
    """Measure the mean cost of the short-sighted player against the fewest pours; draw Figures 16 and 17.

    Raises PlayedCardError or SettingsError for a log of people in the folder of plots that cannot be read.
    """
    people = [card for card in read_played_cards(options.out) if card.solved and card.optimum > 0]
    chance = random.Random(options.seed)
    cards = [card for cost in optima() for card in draw_cards(cost, options.trials or STARTS_EACH, chance)]
    contests = [
        Contest(card, human_pours(card.start, card.goal, chance), plan_pours(card.start, card.goal))
        for card in progress(cards, len(cards), "cards")
    ]
    if options.out is not None:
        _draw(contests, people, options.seed, options.out)
    return [*_human_rows(contests), _planner_row(contests), *_people_rows(people)]


def lost_contest(optimum: int, seed: int) -> Contest:
    """Draw a card of so many pours from the game's start that the human typically loses, as in the paper's Figure 16.

    The human's run is the one of median cost among 21. A card that it plays at the optimum shows no difference: then the
    next card is drawn.
    """
    chance = random.Random(seed)
    contests = (_typical_contest(card, chance) for card in draw_cards(optimum, len(all_states()), chance, START))
    return next(contest for contest in contests if contest.extra > 0)


def _typical_contest(card: Card, chance: random.Random) -> Contest:
    runs = sorted((human_pours(card.start, card.goal, chance) for _ in range(RUNS)), key=len)
    return Contest(card, runs[RUNS // 2], plan_pours(card.start, card.goal))


def _human_rows(contests: Sequence[Contest]) -> list[Row]:
    hard = [contest for contest in contests if contest.card.optimum >= HARD_FROM]
    easy_extra = [contest.extra for contest in contests if contest.card.optimum < HARD_FROM]
    hard_extra = [contest.extra for contest in hard]
    return [
        *(
            mean_row(
                f"human, optimum {cost}",
                [len(contest.human) for contest in contests if contest.card.optimum == cost],
                "pours",
                paper="comparable" if cost < HARD_FROM else "worse",
            )
            for cost in optima()
        ),
        mean_row(
            f"human above the optimum, optima 1 to {HARD_FROM - 1}",
            easy_extra,
            "pours",
            paper="comparable",
            goal=f"< {COMPARABLE_EXTRA}",
            ok=np.mean(easy_extra) < COMPARABLE_EXTRA,
        ),
        mean_row(
            f"human above the optimum, optima {HARD_FROM} to {optima()[-1]}",
            hard_extra,
            "pours",
            paper="worse",
            goal=f"> {COMPARABLE_EXTRA}",
            ok=np.mean(hard_extra) > COMPARABLE_EXTRA,
        ),
        _growth_row(hard),
        mean_row("human by planner", [len(contest.human) / contest.card.optimum for contest in contests], "pours / pour"),
        share_row("human lifts a settled ball", sum(map(_lifts, contests)), len(contests)),
    ]


def _growth_row(hard: Sequence[Contest]) -> Row:
    """Return by how much the human falls further behind with each pour of the optimum: least squares, Student's interval."""
    line = stats.linregress([contest.card.optimum for contest in hard], [contest.extra for contest in hard])
    reach = line.stderr * stats.t.ppf((1 + CONFIDENCE) / 2, len(hard) - 2)
    interval = (float(line.slope - reach), float(line.slope + reach))
    name = f"growth of that from optimum {HARD_FROM} on"
    return Row(name, float(line.slope), "pours / pour", len(hard), interval, "progressively worse", "> 0", line.slope > 0)


def _lifts(contest: Contest) -> bool:
    state = contest.card.start
    for pour in contest.human:
        following = state.after(pour)
        if lifts_settled(state, following, contest.card.goal):
            return True
        state = following
    return False


def _planner_row(contests: Sequence[Contest]) -> Row:
    met = sum(sum(pour.count for pour in contest.planner) == contest.card.optimum for contest in contests)
    return share_row("planner at the optimum", met, len(contests), paper=1.0, goal="all", ok=met == len(contests))


def _people_rows(people: Sequence[PlayedCard]) -> list[Row]:
    return [
        mean_row(f"people, optimum {cost}", [len(card.moves) for card in people if card.optimum == cost], "pours")
        for cost in sorted({card.optimum for card in people})
    ]


def _draw(contests: Sequence[Contest], people: Sequence[PlayedCard], seed: int, folder: Path) -> None:
    # matplotlib takes a second to import: only when there is something to draw
    from dr_eureka.bench.human_plots import draw_costs, draw_flows

    draw_flows([lost_contest(SIMPLE, seed), lost_contest(COMPLEX, seed)], folder / "figure16.png")
    draw_costs(contests, people, folder / "figure17.png")
