"""Work that benchmarks share out to processes."""
import math

from dr_eureka.bench.workers import shared_out


def test_results_come_in_order_however_many_processes_work():
    numbers = range(7)
    expected = [math.sqrt(number) for number in numbers]
    assert shared_out(math.sqrt, numbers, 1, "roots") == expected
    assert shared_out(math.sqrt, numbers, 2, "roots", at_a_time=2) == expected


def test_what_is_to_be_prepared_is_prepared_once_before_any_work():
    calls = []
    shared_out(calls.append, ("first", "second"), 1, "calls", lambda: calls.append("prepared"))
    assert calls == ["prepared", "first", "second"]


def test_no_items_are_no_work():
    assert shared_out(math.sqrt, (), None, "nothing") == []
