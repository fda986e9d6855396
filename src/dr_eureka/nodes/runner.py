"""How every node starts and ends: `--help` without a master, one line and a non-zero exit on bad input."""

from __future__ import annotations

import argparse
import inspect
import signal
import sys
import threading
from typing import Callable

import rospy

from dr_eureka.errors import DrEurekaError


def run_node(name: str, description: str, serve: Callable[[], int]) -> int:
    """Start the node `name`, run `serve` until it returns, and return the exit code of the process.

    `serve` is called after `rospy.init_node`. A DrEurekaError raised in it becomes one line on stderr and exit code 1.
    """
    parser = argparse.ArgumentParser(
        prog=name,
        description=inspect.cleandoc(description),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Remappings (topic:=other) and private parameters (_name:=value) may be given as for any ROS node.",
    )
    parser.parse_args(rospy.myargv()[1:])
    rospy.init_node(name, disable_signals=True)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _shut_down)
    try:
        return serve()
    except DrEurekaError as error:
        print(f"{rospy.get_name()}: {error}", file=sys.stderr, flush=True)
        return 1
    except rospy.ROSException:
        # What a node was just publishing or waiting for when its shutdown began: is_shutdown() tells only of the end.
        if rospy.core.is_shutdown_requested():
            return 0
        raise
    finally:
        rospy.signal_shutdown("the node has ended")


def _shut_down(number: int, _: object) -> None:
    """Shut rospy down from a thread of its own.

    rospy's own handler runs in the main thread, in the middle of whatever that does, and waits for ever for a lock that
    the main thread may hold, such as a publisher's.
    """
    threading.Thread(target=rospy.signal_shutdown, args=(f"signal {number}",), daemon=True).start()
