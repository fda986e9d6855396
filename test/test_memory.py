"""Large arrays come from memory that the process has, not each time from the system."""
import subprocess
import sys

_COUNT_FAULTS = """
import resource, numpy
from dr_eureka.memory import keep_freed_memory
kept = {kept}
def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        arrays = [numpy.ones(2_000_000, numpy.uint8) for _ in range(8)]
        del arrays
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
faults()
print(kept, faults())
"""


def faults(kept):
    """Return what a process of its own answers, and the page faults of filling 16 MB twenty times."""
    output = subprocess.run([sys.executable, "-c", _COUNT_FAULTS.format(kept=kept)], text=True, capture_output=True, check=True)
    answer, count = output.stdout.split()
    return answer, int(count)


def test_freed_memory_is_used_again_without_page_faults():
    assert faults("keep_freed_memory()")[0] == "True"
    assert faults("keep_freed_memory()")[1] < 100 < faults("None")[1]
