#!/usr/bin/env python3
"""The board shown to a live camera topic: the command takes its views, and Ctrl-C ends with a calibration."""

import signal
import subprocess
import sys
import threading
import unittest

import numpy as np
import rospy
import rostest
from board_views import BOARD, SMALL, good_pictures
from launching import path_in, scratch_folder
from sensor_msgs.msg import Image

from dr_eureka.nodes.images import image_from_rgb
from dr_eureka.vision.camera import load_camera

TOPIC = "camera/image_raw"
LIMIT_S = 45.0
# Often enough that the newest picture is followed by one in which the board rests.
RATE_HZ = 20.0


class CalibrateCameraTest(unittest.TestCase):
    def test_views_from_a_topic_become_a_camera_file_when_a_person_ends_it(self):
        rospy.init_node("calibrate_camera_rostest")
        folder = scratch_folder()
        self.addCleanup(folder.cleanup)
        file = path_in(folder, "camera.yaml")
        command = ["rosrun", "dr_eureka", "calibrate_camera", "--topic", TOPIC, "--out", str(file)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        ended = threading.Timer(LIMIT_S, process.kill)
        ended.start()
        self.addCleanup(ended.cancel)
        shown = iter(range(len(good_pictures(BOARD, SMALL))))
        self._publish(next(shown))
        lines = []
        for line in process.stdout:
            lines.append(line)
            if ": view " in line:
                following = next(shown, None)
                if following is None:
                    process.send_signal(signal.SIGINT)
                else:
                    self._publish(following)
        errors = process.stderr.read()
        self.assertEqual(process.wait(), 0, "".join(lines) + errors)
        self.assertIn("interrupted: calibrating with the views so far\n", lines)
        camera = load_camera(file)
        np.testing.assert_allclose(np.diag(camera.matrix), np.diag(SMALL.matrix), rtol=0.01)

    def _publish(self, number):
        """Publish a picture again and again, in place of the one before."""
        if not hasattr(self, "_publisher"):
            self._publisher = rospy.Publisher(TOPIC, Image, queue_size=1)
            self._timer = rospy.Timer(rospy.Duration(1 / RATE_HZ), self._send)
            self.addCleanup(self._timer.shutdown)
        self._picture = good_pictures(BOARD, SMALL)[number]

    def _send(self, _):
        self._publisher.publish(image_from_rgb(self._picture, rospy.Time.now(), "cam_link"))


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "calibrate_camera", CalibrateCameraTest, sys.argv)
