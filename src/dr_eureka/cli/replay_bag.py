"""The command `replay_bag`: print what the robot's vision sees in a recorded bag, without a ROS master."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from typing import Any, Optional

from dr_eureka.bags.frames import IMAGE_TOPIC, RecordedCamera
from dr_eureka.bags.recording import Recording
from dr_eureka.bags.replay import ReplaySettings, Sighting, replay
from dr_eureka.errors import DrEurekaError
from dr_eureka.pieces import load_pieces
from dr_eureka.vision.cards import CardReader


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        settings = ReplaySettings.load()
        with Recording(arguments.bag) as recording:
            camera = RecordedCamera(recording, settings.stillness, arguments.image)
            # torch takes seconds to import: only once there is a camera to look through
            sighting = replay(camera, CardReader.load(), load_pieces(), settings)
            if arguments.json:
                print(json.dumps(sighting_as_mapping(recording, camera, sighting)))
            else:
                print("\n".join(sighting_as_lines(recording, camera, sighting)))
    except DrEurekaError as error:
        print(f"replay_bag: {error}", file=sys.stderr)
        return 2
    return 0


def sighting_as_mapping(recording: Recording, camera: RecordedCamera, sighting: Sighting) -> dict[str, Any]:
    """Return what was seen in the shape of `--json`; `tubes` holds places in `base` [m] and is empty if unknown."""
    if sighting.card is None:
        result, reason = sighting.card_failure
        card = {"result": result, "state": None, "reason": reason}
    else:
        found = sighting.card
        card = {"result": found.result, "state": found.state, "confidence": round(found.confidence, 4)}
    tubes_result, tubes_reason = sighting.tubes_failure or (sighting.tubes.result, "")
    places = sighting.tubes.tubes if sighting.tubes else {}
    return {
        "images": camera.topic.messages,
        "unreadable_images": camera.unreadable,
        "card": card,
        "tubes": {name: [round(float(value), 6) for value in place.position] for name, place in places.items()},
        "tubes_result": tubes_result,
        **({"tubes_reason": tubes_reason} if tubes_reason else {}),
        "topics": {topic.name: {"type": topic.type, "messages": topic.messages} for topic in recording.topics},
    }


def sighting_as_lines(recording: Recording, camera: RecordedCamera, sighting: Sighting) -> Iterator[str]:
    """Yield what was seen as lines for a person."""
    unreadable = f", {camera.unreadable} unreadable" if camera.unreadable else ""
    yield f"{recording.path}: {camera.topic.messages} images on {camera.topic.name}{unreadable}"
    if sighting.card:
        yield f"card: {sighting.card.state} (confidence {sighting.card.confidence:.2f})"
    else:
        yield "card: none, {}: {}".format(*sighting.card_failure)
    if sighting.tubes:
        for name, place in sighting.tubes.tubes.items():
            x, y, z = place.position
            yield f"{name} tube: x {x:.4f}, y {y:.4f}, z {z:.4f} m in base, +-{place.sigma_m * 1000:.1f} mm"
    else:
        yield "tubes: none, {}: {}".format(*sighting.tubes_failure)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="replay_bag",
        description="Print the card and the places of the tubes that the robot's vision sees in a ROS 1 bag.",
        epilog="Images may be raw (rgb8, bgr8, mono8) or compressed (jpeg, png), the bag uncompressed, lz4 or bz2. "
        "Tubes are placed with the camera_info beside the images and robotis/present_joint_states.",
    )
    parser.add_argument("bag", metavar="BAG", help="the recording")
    parser.add_argument(
        "--image",
        default=IMAGE_TOPIC,
        metavar="TOPIC",
        help="image topic, the end of its name is enough (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    return parser
