"""The command `calibrate_camera`: pictures, a folder, a bag or a live topic in; a camera_info yaml or a refusal out."""

import cv2
import numpy as np
import pytest
from board_views import BOARD, SMALL, good_pictures
from recorded_bags import compressed_image, head_states, image, write_bag

from dr_eureka.cli.calibrate_camera import main
from dr_eureka.vision.camera import load_camera

PLAIN = np.full((240, 320, 3), 120, np.uint8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    for number, picture in enumerate(good_pictures(BOARD, SMALL)):
        cv2.imwrite(str(folder / f"view_{number}.png"), picture)
    return folder


def run(tmp_path, *words, live_pictures=None):
    return main([*map(str, words), "--out", str(tmp_path / "camera.yaml")], live_pictures=live_pictures)


def assert_is_the_camera(file):
    camera = load_camera(file)
    assert (camera.width, camera.height) == (320, 240)
    assert np.allclose(np.diag(camera.matrix), np.diag(SMALL.matrix), rtol=0.01)


def test_a_folder_of_pictures_calibrates_and_the_file_is_read_back(tmp_path, folder, capsys):
    assert run(tmp_path, folder) == 0
    assert_is_the_camera(tmp_path / "camera.yaml")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("view_0.png: view 1, ") and "coverage" in lines[0] and "RMS" not in lines[0]
    assert "RMS 0." in lines[9] and lines[9].startswith("view_9.png: view 10, 24 of 24 corners, coverage 73%")
    assert lines[-1] == f"{tmp_path / 'camera.yaml'}: written, and read back the same"


def test_the_picture_shows_where_corners_were_seen(tmp_path, folder, capsys):
    run(tmp_path, folder)
    rows = [line.strip() for line in capsys.readouterr().out.splitlines() if set(line.strip()) == {"#", "."}]
    assert rows and all(len(row) == 8 for row in rows)


def test_pictures_that_are_alike_or_show_no_board_are_left_out_and_said(tmp_path, folder, capsys):
    cv2.imwrite(str(tmp_path / "blank.png"), PLAIN)
    (tmp_path / "cut.png").write_bytes((folder / "view_0.png").read_bytes()[:60])
    names = [folder / "view_0.png", folder / "view_0.png", tmp_path / "blank.png", tmp_path / "cut.png"]
    assert run(tmp_path, *names, folder) == 0
    captured = capsys.readouterr()
    assert "view_0.png: left out, like a view before" in captured.out
    assert "blank.png: left out, 0 of the board's corners seen" in captured.out
    assert "cut.png: picture is cut off" in captured.err


def test_too_few_views_are_refused_in_one_line_and_nothing_is_written(tmp_path, folder, capsys):
    assert run(tmp_path, *(folder / f"view_{number}.png" for number in range(4))) == 1
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert "refused, nothing written: 4 of at least 8 views" in captured.err
    assert not (tmp_path / "camera.yaml").exists()
    assert run(tmp_path, folder / "view_0.png") == 1
    assert "1 of at least 3 views" in capsys.readouterr().err


def test_weak_views_are_written_on_demand_and_the_weakness_is_said(tmp_path, folder, capsys):
    assert run(tmp_path, *(folder / f"view_{number}.png" for number in range(4)), "--anyway") == 0
    assert load_camera(tmp_path / "camera.yaml").width == 320
    assert "written all the same: 4 of at least 8 views" in capsys.readouterr().err


@pytest.mark.parametrize("compressed", [False, True])
def test_a_bag_calibrates_with_the_pictures_in_which_the_board_rests(tmp_path, capsys, compressed):
    messages, stamp_s = [], 10.0
    for picture in good_pictures(BOARD, SMALL):
        for _ in range(2):
            messages.append(compressed_image(stamp_s, picture) if compressed else image(stamp_s, picture))
            stamp_s += 0.1
    topic = "/camera/image_raw/compressed" if compressed else "/camera/image_raw"
    joint_states = {} if compressed else {"/robotis/present_joint_states": head_states(9.9, stamp_s, 0.5)}
    bag = write_bag(tmp_path / "views.bag", {topic: messages, **joint_states})
    assert run(tmp_path, "--bag", bag) == 0
    assert_is_the_camera(tmp_path / "camera.yaml")
    out = capsys.readouterr().out
    assert "10.100 s: view 1, " in out and "view 10, " in out and "view 11, " not in out


def test_a_live_topic_calibrates_with_what_there_was_when_interrupted(tmp_path, capsys):
    def live_pictures(topic):
        assert topic == "camera/image_raw"
        for number, picture in enumerate(good_pictures(BOARD, SMALL)):
            yield f"{number} s", picture
            yield f"{number}.1 s", picture
        raise KeyboardInterrupt

    assert run(tmp_path, "--topic", "camera/image_raw", live_pictures=live_pictures) == 0
    assert_is_the_camera(tmp_path / "camera.yaml")
    assert "interrupted: calibrating with the views so far" in capsys.readouterr().out


def test_another_board_can_be_described(tmp_path, folder, capsys):
    words = ["--size", "7x5", "--square", "0.036", "--marker", "0.028", "--dictionary", "DICT_5X5_50"]
    assert run(tmp_path, folder, *words) == 0
    assert run(tmp_path, folder, "--dictionary", "DICT_6X6_50") == 1
    assert "0 of at least 3 views" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words, reason",
    [
        (["nowhere.png"], "nowhere.png: no picture that can be opened"),
        (["--bag", "nowhere.bag"], "nowhere.bag: no such file"),
        (["x.png", "--dictionary", "DICT_9X9"], "'DICT_9X9' is unknown"),
        (["x.png", "--size", "7x6"], "7x6 squares; expected an odd number of rows"),
        (["x.png", "--marker", "0.05"], "expected less than the squares' 0.036 m"),
    ],
)
def test_bad_input_ends_with_one_line_and_code_2(tmp_path, capsys, words, reason):
    cv2.imwrite(str(tmp_path / "x.png"), PLAIN)
    assert run(tmp_path, *(tmp_path / word if word == "x.png" else word for word in words)) == 2
    error = capsys.readouterr().err
    assert reason in error and "Traceback" not in error


@pytest.mark.parametrize("words", [[], ["a.png", "--bag", "b.bag"], ["a.png", "--size", "7"], ["a.png", "--square", "-1"]])
def test_arguments_that_make_no_sense_are_a_usage_error(words):
    with pytest.raises(SystemExit) as stop:
        main(words, live_pictures=None)
    assert stop.value.code == 2


def test_a_file_that_cannot_be_written_is_named(tmp_path, folder, capsys):
    assert run(tmp_path / "nowhere", folder) == 2
    assert "camera.yaml: cannot be written: No such file or directory" in capsys.readouterr().err
