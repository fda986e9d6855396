"""ROS node that plays the game: reads card and tubes, plans, has the control engine carry the plan out, and looks again."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from typing import Mapping

import numpy as np
import rospy

from dr_eureka import srv
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.game_flow import GameFlow
from dr_eureka.behaviour.looks import CardLook, Looks, TubeLook
from dr_eureka.behaviour.observation import Frame, Observation
from dr_eureka.behaviour.report import GameCode
from dr_eureka.control.codes import POUR_METHODS
from dr_eureka.game.planner import STRATEGIES, Planner
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.nodes.announcer import Announcer
from dr_eureka.nodes.bag_check import check_bag
from dr_eureka.nodes.engine_client import EngineClient
from dr_eureka.nodes.folders import resolve
from dr_eureka.nodes.parameters import private_parameters, refuse_rest, take, take_choice, take_count, take_state_unless
from dr_eureka.nodes.runner import run_node
from dr_eureka.nodes.sight import TRANSPORTS, Sight, SightSettings
from dr_eureka.pieces import load_pieces
from dr_eureka.settings import build
from dr_eureka.vision.camera import load_camera
from dr_eureka.vision.cards import CardReader, CardSettings
from dr_eureka.vision.contents import ContentsReading, ContentsSettings, read_contents
from dr_eureka.vision.tubes import TubeScene, TubeSettings, locate_tubes
from dr_eureka.vision.voting import CardVote, LossVote, TubeVote, VoteSettings

NAME = "dr_eureka_main"
_SECONDS = {"min": 0.01, "max": 600.0}
# Time for the last, latched messages to leave the process before it ends.
_LINGER_S = 1.0


@dataclass(frozen=True)
class MainSettings:
    """The `node:` block of config/dr_eureka_main.yaml, which explains it."""

    period: float = field(metadata=_SECONDS)
    status_period: float = field(metadata=_SECONDS)
    service_limit: float = field(metadata=_SECONDS)
    image_max_age: float = field(metadata=_SECONDS)
    pose_limit: float = field(metadata=_SECONDS)
    still_window: float = field(metadata=_SECONDS)
    still_tolerance: float = field(metadata={"min": 0.0, "max": 0.1})
    history: float = field(metadata=_SECONDS)
    replay_history: float = field(metadata=_SECONDS)
    replay_backlog: int = field(metadata={"min": 1, "max": 10000})


class DrEurekaMain:
    """The Dr. Eureka Main node of the paper's Figure 5.

    ROS Publishers (latched but for the readings and the image):
        * **~status** (dr_eureka/GameStatus): phase, code, what was done; on change and at 2 Hz
        * **~card** (dr_eureka/CardDetection): the card that was decided on; **~card_readings** (dr_eureka/CardDetection):
          what each image showed, with the reason if no card was read
        * **~card_image** (sensor_msgs/Image): each reading drawn into its image, only while somebody subscribes
        * **~plan** (dr_eureka/Plan), **~tubes** (dr_eureka/TubeScene)
    ROS Subscribers:
        * **camera/image_raw** (sensor_msgs/Image; rgb8, bgr8, mono8) or **camera/image_raw/compressed**, only while it
          looks; **camera/camera_info** (sensor_msgs/CameraInfo)
        * **robotis/present_joint_states** (sensor_msgs/JointState): where the head is
        * **control_engine/status** (dr_eureka/EngineStatus)
    ROS Services:
        * **~confirm_card** (dr_eureka/ConfirmCard): confirm or correct the card, in phase WAITING_FOR_CONFIRMATION
    ROS Services called:
        * **control_engine/set_joints**, **control_engine/execute_strategy**, **control_engine/go_on**
    ROS Parameters:
        * **~goal** (str): state to reach instead of a card, such as RR|GG|PP, or `card`: read one
        * **~games** (int): games to play, each from what the tubes are seen to hold
        * **~confirm_card** (bool): wait after each card, before any motion of the arms, until a person confirms or corrects it
        * **~strategy** (str): fewest, fastest or surest; **~pour** (str): lock, linear or profiled
        * **~image_transport** (str): raw or compressed
        * **~camera_calibration** (str): file that calibrate_camera wrote, used instead of camera/camera_info; or `none`
        * **~replay** (bool): command nothing, look at recorded images; **~bag** (str): the recording, checked first
        * **~stay** (bool): go on publishing the result when all games are over
        * node, flow, votes, cards, tubes, contents: see config/dr_eureka_main.yaml
    """

    def __init__(self, flow: GameFlow, sight: Sight, engine: EngineClient | None, announcer: Announcer, settings: MainSettings):
        self._flow = flow
        self._sight = sight
        self._engine = engine
        self._announcer = announcer
        self._settings = settings
        # Services are answered by threads of their own.
        self._lock = threading.Lock()
        rospy.Service("~confirm_card", srv.ConfirmCard, self._confirm_card)

    def play(self) -> int:
        """Play until all games are over or the node is shut down; return the exit code."""
        published_s = 0.0
        while not rospy.is_shutdown() and not self._flow.over:
            self._sight.open(self._flow.looking)
            with self._lock:
                try:
                    self._flow.step(self._observe())
                except Exception as error:  # the engine must be left holding and the scorekeeper told, whatever went wrong
                    rospy.logerr("%s: %s", type(error).__name__, error)
                    self._flow.fail(GameCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}")
            if time.monotonic() - published_s > self._settings.status_period:
                published_s = time.monotonic()
                self._announcer.on_report(self._flow.report())
            time.sleep(self._settings.period)
        self._sight.open(False)
        return 0 if self._flow.report().code in (GameCode.SOLVED, GameCode.REPLAYED) else 1

    def _confirm_card(self, request: srv.ConfirmCardRequest) -> srv.ConfirmCardResponse:
        with self._lock:
            answer = self._flow.confirm_card(request.state)
        return srv.ConfirmCardResponse(getattr(srv.ConfirmCardResponse, answer.code), answer.message)

    def _observe(self) -> Observation:
        return Observation(
            wall_s=time.monotonic(),
            robot_s=rospy.get_time(),
            engine=self._engine.view if self._engine else None,
            frame=self._sight.take(),
            camera_seen=self._sight.seen,
            camera_problem=self._sight.problem,
            camera_frozen=self._sight.frozen,
            head=self._sight.head,
        )


def _serve() -> int:
    parameters = private_parameters()
    where = f"{rospy.get_name()} parameters"
    settings = build(MainSettings, take(parameters, "node"), f"{where} node")
    flow_settings = build(FlowSettings, take(parameters, "flow"), f"{where} flow")
    votes = build(VoteSettings, take(parameters, "votes"), f"{where} votes")
    card_settings = build(CardSettings, take(parameters, "cards"), f"{where} cards")
    contents_settings = build(ContentsSettings, take(parameters, "contents"), f"{where} contents")
    tube_settings = build(TubeSettings, take(parameters, "tubes"), f"{where} tubes")
    goal = take_state_unless(parameters, "goal", "card")
    games = take_count(parameters, "games", least=1)
    pour = take_choice(parameters, "pour", POUR_METHODS)
    transport = take_choice(parameters, "image_transport", TRANSPORTS)
    strategy = take_choice(parameters, "strategy", STRATEGIES)
    confirm_card = take_choice(parameters, "confirm_card", (False, True))
    replay, stay = take_choice(parameters, "replay", (False, True)), take_choice(parameters, "stay", (False, True))
    calibration = str(take(parameters, "camera_calibration"))
    bag = str(parameters.pop("bag", ""))
    refuse_rest(parameters)
    if replay:
        check_bag(resolve(bag), transport)

    camera = None if calibration == "none" else load_camera(resolve(calibration))
    reader, pieces = CardReader.load(card_settings), load_pieces()

    def locate(frame: Frame) -> TubeScene:
        return locate_tubes(frame.image, frame.camera, frame.base_from_camera, pieces, tube_settings)

    def read_balls(frame: Frame, scene: TubeScene) -> ContentsReading:
        return read_contents(
            frame.image, frame.camera, frame.base_from_camera, scene.tubes, pieces, contents_settings, scene.base_from_sheet
        )

    def read_held(frame: Frame, held: Mapping[str, np.ndarray]) -> ContentsReading:
        return read_contents(frame.image, frame.camera, frame.base_from_camera, {}, pieces, contents_settings, held=held)

    announcer = Announcer(strategy)
    engine = None if replay else EngineClient(settings.service_limit, load_planner_settings().hands_at_once)
    flow = GameFlow(
        flow_settings,
        goal=goal,
        games=games,
        planner=Planner(strategy, pour),
        looks=Looks(
            card=lambda: CardLook(reader.read, CardVote(votes.card), announcer.on_card_reading),
            tubes=lambda: TubeLook(
                locate, read_balls, TubeVote(votes.tubes), CardVote(votes.contents), LossVote(votes.lost)
            ),
            read_held=read_held,
        ),
        listener=announcer,
        robot=engine,
        confirm_card=confirm_card,
    )
    sight_settings = SightSettings(
        settings.image_max_age,
        settings.pose_limit,
        settings.still_window,
        settings.still_tolerance,
        backlog=settings.replay_backlog if replay else 1,
        history=settings.replay_history if replay else settings.history,
    )
    code = DrEurekaMain(flow, Sight(sight_settings, transport, camera), engine, announcer, settings).play()
    if stay:
        rospy.spin()
    else:
        time.sleep(_LINGER_S)
    return code


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, DrEurekaMain.__doc__, _serve)
