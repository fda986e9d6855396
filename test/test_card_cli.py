"""The command recognise_card: one line a picture, non-zero exit when one cannot be opened."""
import json

import cv2
import numpy as np
import pytest

from dr_eureka.cli.recognise_card import main
from dr_eureka.vision.card_renderer import render_card

STATE = "RGPR|GP|"


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    card = np.full((480, 640, 3), 110, np.uint8)
    card[150:290, 250:390] = cv2.resize(render_card(STATE, 4, 280), (140, 140), interpolation=cv2.INTER_AREA)
    card = card[..., ::-1]
    opaque = np.dstack([card, np.full(card.shape[:2], 255, np.uint8)])
    for name, picture in {
        "card.png": card,
        "card.jpg": card,
        "deep.png": card.astype(np.uint16) * 257,
        "alpha.png": opaque,
        "large.png": cv2.resize(card, (4000, 3000), interpolation=cv2.INTER_AREA),
        "table.jpg": np.full((100, 640, 3), 110, np.uint8),
        "black.png": np.zeros((480, 640, 3), np.uint8),
        "white.png": np.full((480, 640, 3), 255, np.uint8),
        "point.png": np.zeros((1, 1, 3), np.uint8),
        "ribbon.png": np.zeros((32, 100_000, 3), np.uint8),
        "large_grey.jpg": np.full((3000, 4000, 3), 128, np.uint8),
    }.items():
        cv2.imwrite(str(folder / name), picture)
    (folder / "cut.png").write_bytes((folder / "card.png").read_bytes()[:-100])
    photo = (folder / "card.jpg").read_bytes()
    (folder / "cut.jpg").write_bytes(photo[: len(photo) * 3 // 4])
    # EXIF orientation 6: the camera was held upright, the picture must be turned a quarter clockwise to be seen right.
    exif = b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00" + bytes(4)
    on_its_side = cv2.imencode(".jpg", np.rot90(card))[1].tobytes()
    marker = b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big")
    (folder / "turned.jpg").write_bytes(on_its_side[:2] + marker + exif + on_its_side[2:])
    (folder / "empty.png").write_bytes(b"")
    (folder / "text.jpg").write_text("no picture\n", encoding="ascii")
    return folder


def test_json_has_one_object_a_picture_in_order(pictures, capsys):
    names = [str(pictures / "card.png"), str(pictures / "table.jpg")]
    assert main([*names, "--json"]) == 0
    first, second = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (first["image"], first["result"], first["state"]) == (names[0], "OK", STATE)
    assert 0.5 < first["confidence"] <= 1.0 and len(first["corners"]) == 4
    assert (second["image"], second["result"], second["state"]) == (names[1], "NO_CARD", None)
    assert second["reason"]


def test_plain_output_names_the_picture_and_its_state(pictures, capsys):
    assert main([str(pictures / name) for name in ("card.png", "cut.png", "table.jpg")]) == 2
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith(f"card.png: {STATE}")
    assert "cut.png: UNREADABLE_FILE, picture is cut off after" in lines[1] and "table.jpg: NO_CARD" in lines[2]


def test_a_card_is_read_from_every_kind_of_picture(pictures, capsys):
    names = ["card.png", "card.jpg", "deep.png", "alpha.png", "large.png", "turned.jpg"]
    assert main([*(str(pictures / name) for name in names), "--json"]) == 0
    readings = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [reading["state"] for reading in readings] == [STATE] * len(names)
    # Of a photo on its side the corners are those of the picture as it is seen.
    np.testing.assert_allclose(readings[-1]["corners"], readings[1]["corners"], atol=3.0)
    np.testing.assert_allclose(np.array(readings[4]["corners"]) / 6.25, readings[0]["corners"], atol=3.0)


@pytest.mark.parametrize("name", ["black.png", "white.png", "point.png", "ribbon.png", "large_grey.jpg"])
def test_a_picture_that_shows_nothing_has_no_card(pictures, capsys, name):
    assert main([str(pictures / name), "--json"]) == 0
    reading = json.loads(capsys.readouterr().out)
    assert (reading["result"], reading["state"]) == ("NO_CARD", None) and reading["reason"]


@pytest.mark.parametrize("name", ["cut.png", "cut.jpg", "empty.png", "text.jpg", "missing.png", "."])
def test_a_file_that_is_no_picture_has_a_line_too_and_the_others_are_still_read(pictures, capsys, name):
    assert main([str(pictures / name), str(pictures / "card.png"), "--json"]) == 2
    captured = capsys.readouterr()
    broken, good = (json.loads(line) for line in captured.out.splitlines())
    assert (broken["image"], broken["result"], broken["state"]) == (str(pictures / name), "UNREADABLE_FILE", None)
    assert "\n" not in broken["reason"] and broken["reason"]
    assert good["state"] == STATE
    assert captured.err == "recognise_card: 1 of 2 pictures could not be opened\n"


def test_no_picture_at_all_is_a_usage_error(capsys):
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2
