"""The verdict of a session of games, read from the `game.json` that the scorekeeper wrote.

`scripts/play` and `scripts/replay` end with it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from dr_eureka.behaviour.report import GameCode
from dr_eureka.errors import DrEurekaError

GAME_FILE = "game.json"


class VerdictError(DrEurekaError):
    """A game left no result, or one that cannot be read."""


def report(out: Path, games_wanted: int = 1, since_s: float = 0.0, launch_code: int = 0) -> int:
    """Print one line a game; return 0 only if as many as wanted were played and the referee calls each solved.

    A file last written before `since_s` (Unix time) is that of an earlier session and does not count. `launch_code` is
    the exit code of the launch, for the message when it left no result.
    """
    try:
        games = _new_games(out, since_s, launch_code)
    except VerdictError as error:
        return _failed("play", str(error))
    for game in games:
        print(f"play: {describe(game)}; {out / GAME_FILE}")
    if len(games) != games_wanted:
        return _failed("play", f"{len(games)} of {games_wanted} games were played")
    return 0 if all(game.get("solved") is True for game in games) else 1


def report_replay(out: Path, since_s: float = 0.0, launch_code: int = 0) -> int:
    """Print one line about a replay; return 0 only if goal, plan and tubes were found in the recording."""
    try:
        game = _new_games(out, since_s, launch_code)[-1]
    except VerdictError as error:
        return _failed("replay", str(error))
    if game.get("verdict") != GameCode.REPLAYED:
        return _failed("replay", f"NOT REPLAYED: {game.get('verdict')} ({game.get('message')}); {out / GAME_FILE}")
    print(f"replay: REPLAYED: {game.get('start')} to {game.get('goal')}, plan and tubes found; {out / GAME_FILE}")
    return 0


def _new_games(out: Path, since_s: float, launch_code: int) -> list[dict[str, Any]]:
    file = out / GAME_FILE
    # File systems keep coarser time than the clock: a file may look a little older than it is.
    if not file.exists() or file.stat().st_mtime < since_s - 0.1:
        raise VerdictError(
            f"no {GAME_FILE} in {out}: the launch ended (exit code {launch_code}) before it had a result; the reason stands above"
        )
    return read_games(file)


def read_games(file: Path) -> list[dict[str, Any]]:
    """Read a `game.json`: the games it lists under `games`, or the one game that it is.

    Raises VerdictError naming the file when it is not of that kind.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise VerdictError(f"{file}: cannot be read: {error}; expected the result of a game") from error
    games = content.get("games", [content]) if isinstance(content, dict) else None
    if not isinstance(games, list) or not games or not all(isinstance(game, dict) for game in games):
        raise VerdictError(f"{file}: is not the result of a game; expected a JSON object with 'solved'")
    return games


def describe(game: dict[str, Any]) -> str:
    """Return one line about a game: how it ended, from where to where, and what it cost."""
    verdict = {True: "SOLVED", False: "NOT SOLVED"}.get(game.get("solved"), "NOT JUDGED (no referee)")
    facts = [f"{game.get('start') or 'an unknown state'} to {game.get('goal') or 'an unknown goal'}"]
    if game.get("solved") is not True:
        facts.append(f"robot says {game.get('verdict')}" + (f" ({game['message']})" if game.get("message") else ""))
    facts.append(f"pours {game.get('pours')}")
    if game.get("balls_lost"):
        facts.append(f"balls lost {game['balls_lost']}")
    for key, name in (("simulated_seconds", "s simulated"), ("wall_seconds", "s of wall time")):
        if isinstance(game.get(key), (int, float)):
            facts.append(f"{game[key]:.0f} {name}")
    return f"{verdict}: {', '.join(facts)}"


def _failed(program: str, message: str) -> int:
    print(f"{program}: {message}", file=sys.stderr)
    return 1
