"""What the game node tells the world: where the game stands, and what it sees."""

from __future__ import annotations

from typing import Optional, Sequence

import rospy
from sensor_msgs.msg import Image

from dr_eureka import msg
from dr_eureka.behaviour.looks import CardFinding, TubesFinding
from dr_eureka.behaviour.observation import Frame
from dr_eureka.behaviour.report import GameCode, GameReport, Phase
from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour, State
from dr_eureka.nodes import messages
from dr_eureka.nodes.images import image_from_rgb
from dr_eureka.vision.card_drawing import draw_card_reading
from dr_eureka.vision.cards import CardReading


class _CardImage(rospy.SubscribeListener):
    """The last card reading drawn into its image: to every subscriber, also to one who comes later; for nobody, undrawn."""

    def __init__(self) -> None:
        super().__init__()
        self._last: Optional[tuple[Frame, CardReading]] = None
        self._publisher = rospy.Publisher("~card_image", Image, subscriber_listener=self, queue_size=2)

    def show(self, frame: Frame, reading: CardReading) -> None:
        """Take one more reading."""
        self._last = frame, reading
        if self._publisher.get_num_connections():
            self._publisher.publish(self._drawn())

    def peer_subscribe(self, topic_name: str, topic_publish, peer_publish) -> None:
        """Draw for somebody who has just subscribed."""
        if self._last:
            peer_publish(self._drawn())

    def _drawn(self) -> Image:
        frame, reading = self._last
        header = messages.header_to_message(frame.header)
        return image_from_rgb(draw_card_reading(frame.image, reading), header.stamp, header.frame_id)


class Announcer:
    """Publishes what the game flow finds out (`behaviour.report.Listener`)."""

    def __init__(self, strategy: str) -> None:
        self._strategy = strategy
        self._card = rospy.Publisher("~card", msg.CardDetection, queue_size=10, latch=True)
        self._card_readings = rospy.Publisher("~card_readings", msg.CardDetection, queue_size=10)
        self._card_image = _CardImage()
        self._plan = rospy.Publisher("~plan", msg.Plan, queue_size=10, latch=True)
        self._tubes = rospy.Publisher("~tubes", msg.TubeScene, queue_size=10, latch=True)
        self._status = rospy.Publisher("~status", msg.GameStatus, queue_size=50, latch=True)
        self._told: tuple[str, int] = ("", -1)

    def on_card_reading(self, frame: Frame, reading: CardReading) -> None:
        """Publish what one image showed, decided or not."""
        self._card_readings.publish(messages.card_to_message(reading, frame.header, images=1))
        self._card_image.show(frame, reading)

    def on_card(self, finding: CardFinding) -> None:
        """Publish the card that was read."""
        self._card.publish(messages.card_to_message(finding.reading, finding.header, finding.images))
        rospy.loginfo("card: %s (%d images)", finding.state, finding.images)

    def on_confirmation(self, card: State, goal: State) -> None:
        """Log what a person said of the card."""
        if goal == card:
            rospy.loginfo("card: %s confirmed", card)
        else:
            rospy.logwarn("card: read as %s, corrected to %s", card, goal)

    def on_plan(self, start: State, goal: State, pours: Sequence[Pour], actions: Sequence[Action]) -> None:
        """Publish the plan."""
        plan = msg.Plan(start=str(start), goal=str(goal), strategy=self._strategy)
        plan.pours = [messages.pour_to_message(pour) for pour in pours]
        plan.actions = [messages.action_to_message(action) for action in actions]
        plan.header.stamp = rospy.get_rostime()
        self._plan.publish(plan)
        rospy.loginfo("plan: %s to %s, %d pours, %d actions", start, goal, len(pours), len(actions))

    def on_tubes(self, finding: TubesFinding) -> None:
        """Publish where the tubes stand and what they hold."""
        self._tubes.publish(messages.scene_to_message(finding))
        feet = {name: place.position for name, place in finding.tubes.items()}
        places = ", ".join(f"{name} ({foot[0]:.4f}, {foot[1]:.4f})" for name, foot in feet.items())
        rospy.loginfo("tubes: %s at %s (%d images)", finding.state, places, finding.images)

    def on_surprise(self, expected: State, seen: State) -> None:
        """Log that a pour went wrong."""
        rospy.logwarn("tubes: they hold %s, expected %s: planning anew", seen, expected)

    def on_hands(self, message: str) -> None:
        """Log what was seen of the tubes in the hands."""
        rospy.logwarn("%s", message)

    def on_fault(self, message: str) -> None:
        """Log that a grasp failed."""
        rospy.logwarn("%s: looking again", message)

    def on_report(self, report: GameReport) -> None:
        """Publish where the game stands, and log a new phase."""
        self._status.publish(messages.report_to_message(report, rospy.get_time()))
        if (report.phase, report.game) == self._told:
            return
        self._told = report.phase, report.game
        log = rospy.logerr if report.phase == Phase.FAILED else rospy.loginfo
        ending = f": {report.code}" if report.code != GameCode.UNDECIDED else ""
        log("game %d of %d: %s%s %s", report.game + 1, report.games, report.phase, ending, report.message)
