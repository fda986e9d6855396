"""Launch files run by a test as a person would run them, on the test's own master."""

import os
import signal
import subprocess
import tempfile
from pathlib import Path

STOP_S = 20.0
# rosbag play does not listen while it waits to begin.
INTERRUPT_S = 5.0


class Launch:
    """`roslaunch dr_eureka FILE ARG:=VALUE...` until it ends by itself or the test ends it; its output goes to a file."""

    def __init__(self, file, arguments, namespace="/"):
        words = [f"{name}:={value}" for name, value in arguments.items()]
        self._output = tempfile.TemporaryFile(mode="w+")
        self._process = subprocess.Popen(
            ["roslaunch", f"--sigint-timeout={INTERRUPT_S}", "dr_eureka", file, *words],
            stdout=self._output,
            stderr=subprocess.STDOUT,
            # Unbuffered, so that what is said on stdout and on stderr stands in the order in which it was said.
            env={**os.environ, "ROS_NAMESPACE": namespace, "PYTHONUNBUFFERED": "1"},
        )

    def wait(self, limit_s):
        """Return all output once the launch has ended; raise subprocess.TimeoutExpired when it does not."""
        self._process.wait(limit_s)
        return self.output()

    def output(self):
        """Return what was printed so far, from the first node's start on."""
        self._output.seek(0)
        return self._output.read().partition("ROS_MASTER_URI=")[2]

    def stop(self):
        """End the launch if it is still running."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._output.close()


def scratch_folder():
    """Return a new folder for one test's files."""
    return tempfile.TemporaryDirectory(prefix="dr_eureka_rostest_")


def path_in(folder, *names):
    """Return a path inside a scratch folder."""
    return Path(folder.name).joinpath(*names)
