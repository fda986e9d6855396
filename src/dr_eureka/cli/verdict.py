"""The verdict of a session of games, read from the `game.json` that the scorekeeper wrote.

`scripts/play` ends with it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from dr_eureka.errors import DrEurekaError

GAME_FILE = "game.json"


class VerdictError(DrEurekaError):
    """A game left no result, or one that cannot be read."""


def report(out: Path, games_wanted: int = 1, since_s: float = 0.0, launch_code: int = 0) -> int:
    """Print one line a game; return 0 only if as many as wanted were played and the referee calls each solved.

    A file last written before `since_s` (Unix time) is that of an earlier session and does not count. `launch_code` is
    the exit code of the launch, for the message when it left no result.
    """
    file = out / GAME_FILE
    # File systems keep coarser time than the clock: a file may look a little older than it is.
    if not file.exists() or file.stat().st_mtime < since_s - 0.1:
        return _failed(
            f"no {GAME_FILE} in {out}: the launch ended (exit code {launch_code}) before a game was over; the reason stands above"
        )
    try:
        games = read_games(file)
    except VerdictError as error:
        return _failed(str(error))
    for game in games:
        print(f"play: {describe(game)}; {file}")
    if len(games) != games_wanted:
        return _failed(f"{len(games)} of {games_wanted} games were played")
    return 0 if all(game.get("solved") is True for game in games) else 1


def read_games(file: Path) -> list[dict[str, Any]]:
    """Read a `game.json`: the games it lists under `games`, or the one game that it is.

    Raises VerdictError naming the file when it is not of that kind.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise VerdictError(f"{file}: cannot be read: {error}; expected the result of a game") from error
    games = content.get("games", [content]) if isinstance(content, dict) else None
    if not isinstance(games, list) or not all(isinstance(game, dict) for game in games):
        raise VerdictError(f"{file}: is not the result of a game; expected a JSON object with 'solved'")
    return games


def describe(game: dict[str, Any]) -> str:
    """Return one line about a game: how it ended, from where to where, and what it cost."""
    verdict = {True: "SOLVED", False: "NOT SOLVED"}.get(game.get("solved"), "NOT JUDGED (no referee)")
    facts = [f"{game.get('start')} to {game.get('goal') or 'an unknown goal'}"]
    if game.get("solved") is not True:
        facts.append(f"robot says {game.get('verdict')}" + (f" ({game['message']})" if game.get("message") else ""))
    facts.append(f"pours {game.get('pours')}")
    if game.get("balls_lost"):
        facts.append(f"balls lost {game['balls_lost']}")
    for key, name in (("simulated_seconds", "s simulated"), ("wall_seconds", "s of wall time")):
        if isinstance(game.get(key), (int, float)):
            facts.append(f"{game[key]:.0f} {name}")
    return f"{verdict}: {', '.join(facts)}"


def _failed(message: str) -> int:
    print(f"play: {message}", file=sys.stderr)
    return 1
