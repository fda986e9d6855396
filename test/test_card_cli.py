"""The command recognise_card: one line a picture, non-zero exit when one cannot be opened."""
import json

import cv2
import numpy as np
import pytest

from dr_eureka.cli.recognise_card import main
from dr_eureka.vision.card_renderer import render_card


@pytest.fixture
def pictures(tmp_path):
    card = np.full((480, 640, 3), 110, np.uint8)
    card[150:290, 250:390] = cv2.resize(render_card("RGPR|GP|", 4, 280), (140, 140), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(tmp_path / "card.png"), card[..., ::-1])
    cv2.imwrite(str(tmp_path / "table.jpg"), card[:100])
    (tmp_path / "cut.png").write_bytes((tmp_path / "card.png").read_bytes()[:40])
    (tmp_path / "empty.png").write_bytes(b"")
    return tmp_path


def test_json_has_one_object_a_picture_in_order(pictures, capsys):
    names = [str(pictures / "card.png"), str(pictures / "table.jpg")]
    assert main([*names, "--json"]) == 0
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (first["image"], first["result"], first["state"]) == (names[0], "OK", "RGPR|GP|")
    assert 0.5 < first["confidence"] <= 1.0 and len(first["corners"]) == 4
    assert (second["image"], second["result"], second["state"]) == (names[1], "NO_CARD", None)
    assert second["reason"]


def test_plain_output_names_the_picture_and_its_state(pictures, capsys):
    assert main([str(pictures / "card.png"), str(pictures / "table.jpg")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith("card.png: RGPR|GP|") and "NO_CARD" in lines[1]


@pytest.mark.parametrize("name", ["cut.png", "empty.png", "missing.png", "."])
def test_a_file_that_is_no_picture_is_named_and_the_others_are_still_read(pictures, capsys, name):
    assert main([str(pictures / name), str(pictures / "card.png"), "--json"]) == 1
    captured = capsys.readouterr()
    assert json.loads(captured.out)["state"] == "RGPR|GP|"
    assert captured.err.count("\n") == 1 and str(pictures / name) in captured.err


def test_no_picture_at_all_is_a_usage_error(capsys):
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2
