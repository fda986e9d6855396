"""ROS node that writes `game.json` and ends the launch when all games are over."""

from __future__ import annotations

import json
import os
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import rospy

from dr_eureka import msg
from dr_eureka.behaviour.report import GameCode, GameReport, Phase
from dr_eureka.behaviour.scorecard import Ruling, Scorecard
from dr_eureka.errors import DrEurekaError
from dr_eureka.nodes import messages
from dr_eureka.nodes.folders import output_folder
from dr_eureka.nodes.parameters import private_parameters, refuse_rest, take, take_choice, take_count
from dr_eureka.nodes.runner import run_node
from dr_eureka.settings import build

NAME = "scorekeeper"
FILE = "game.json"
_WAIT_S = 0.5
_CUT_SHORT = "the launch ended before the game was over"


class ScoreError(DrEurekaError):
    """The result cannot be written, or no result ever came."""


@dataclass(frozen=True)
class ScorekeeperSettings:
    """The `node:` block of config/scorekeeper.yaml; wall time [s]."""

    referee_limit: float = field(metadata={"min": 0.1, "max": 600.0})


class Scorekeeper:
    """Follows the games and writes `game.json` under `~out`; it is the node whose end ends the launch.

    Exit code 0 when every game was finished (and solved, where there is a referee), else 1.

    ROS Subscribers:
        * **dr_eureka_main/status** (dr_eureka/GameStatus)
        * **referee** (dr_eureka/Referee): only with `~referee`
    ROS Parameters:
        * **~out** (str): folder for `game.json`, made when missing; relative to where roslaunch was started
        * **~referee** (bool): wait for the referee's ruling on each game; false on the real robot
        * **~seed** (int): written into the file
    """

    def __init__(self, folder: Path, seed: int, with_referee: bool, settings: ScorekeeperSettings):
        self._folder = folder
        self._with_referee = with_referee
        self._settings = settings
        self._card = Scorecard(seed if with_referee else None)
        self._changed = threading.Condition()
        self._ended: list[tuple[float, GameReport]] = []
        self._open_report: GameReport | None = None
        self._last_over = False
        self._rulings: list[tuple[float, Ruling]] = []
        self._ended_wall_s = 0.0
        if with_referee:
            rospy.Subscriber("referee", msg.Referee, self._on_referee, queue_size=50)
        rospy.Subscriber("dr_eureka_main/status", msg.GameStatus, self._on_status, queue_size=50)

    def serve(self) -> int:
        """Wait for all games to end, write the file, return the exit code."""
        with self._changed:
            while not self._all_written() and not rospy.is_shutdown():
                self._score()
                if not self._all_written():
                    self._changed.wait(_WAIT_S)
            if self._open_report:
                self._card.add(replace(self._open_report, message=_CUT_SHORT), None)
        if not self._card.games:
            return 1
        self._write()
        result = self._card.as_mapping()
        summary = ", ".join(f"{key} {result[key]}" for key in ("verdict", "solved", "balls_lost", "goal"))
        rospy.loginfo("game over: %s", summary)
        games = result.get("games", [result])
        # Without a referee the robot's own verdict has to do.
        solved = [game["verdict"] in (GameCode.SOLVED, GameCode.REPLAYED) if game["solved"] is None else game["solved"] for game in games]
        return 0 if all(solved) and self._last_over else 1

    def _all_written(self) -> bool:
        return self._last_over and self._card.games == len(self._ended)

    def _on_status(self, status: msg.GameStatus) -> None:
        report = messages.report_from_message(status)
        with self._changed:
            if report.phase in (Phase.FINISHED, Phase.FAILED) and report.game == len(self._ended):
                self._ended.append((status.header.stamp.to_sec(), report))
                self._ended_wall_s = time.monotonic()
                self._last_over = report.last
                self._changed.notify()
            self._open_report = report if report.game == len(self._ended) else None

    def _on_referee(self, message: msg.Referee) -> None:
        ruling = Ruling(message.state or None, message.balls_lost, tuple(message.tubes_standing))
        with self._changed:
            self._rulings = self._rulings[-20:] + [(message.header.stamp.to_sec(), ruling)]
            self._changed.notify()

    def _score(self) -> None:
        """Record each ended game with the first ruling that is not older than its end, or without when none comes."""
        while self._card.games < len(self._ended):
            ended_s, report = self._ended[self._card.games]
            ruling = next((ruling for at_s, ruling in self._rulings if at_s >= ended_s), None)
            overdue = time.monotonic() - self._ended_wall_s > self._settings.referee_limit
            if ruling is None and self._with_referee and not overdue:
                return
            if ruling is None and self._with_referee:
                rospy.logerr("no ruling on %s within %g s", rospy.resolve_name("referee"), self._settings.referee_limit)
            self._card.add(report, ruling)

    def _write(self) -> None:
        """Write the file in one go: a reader never sees half of it."""
        unfinished = self._folder / f".{FILE}.{os.getpid()}"
        try:
            unfinished.write_text(json.dumps(self._card.as_mapping(), indent=2) + "\n", encoding="utf-8")
            unfinished.replace(self._folder / FILE)
        except OSError as error:
            raise ScoreError(f"{self._folder / FILE}: cannot be written: {error.strerror}") from error
        rospy.loginfo("wrote %s", self._folder / FILE)


def _serve() -> int:
    parameters = private_parameters()
    settings = build(ScorekeeperSettings, take(parameters, "node"), f"{rospy.get_name()} parameters node")
    folder = output_folder(str(take(parameters, "out")))
    seed, referee = take_count(parameters, "seed", least=0), take_choice(parameters, "referee", (False, True))
    refuse_rest(parameters)
    # The result of an earlier game must not be taken for this one's.
    (folder / FILE).unlink(missing_ok=True)
    return Scorekeeper(folder, seed, referee, settings).serve()


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, Scorekeeper.__doc__, _serve)
