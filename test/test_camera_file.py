"""A calibration written for ROS's camera drivers, read back by us and by ROS's own parser."""

import camera_calibration_parsers
import numpy as np
import pytest

from dr_eureka.resources import ResourceError
from dr_eureka.vision.camera import CameraError, CameraModel, load_camera, save_camera

LAB = CameraModel.lab(distorted=True)


@pytest.fixture
def file(tmp_path):
    save_camera(LAB, tmp_path / "head.yaml", "head_camera")
    return tmp_path / "head.yaml"


def test_what_is_written_is_read_back_to_the_last_digit(file):
    camera = load_camera(file)
    assert (camera.width, camera.height) == (640, 480)
    assert np.array_equal(camera.matrix, LAB.matrix)
    assert np.array_equal(camera.distortion, LAB.distortion)


def test_the_parser_of_ros_reads_the_same_camera(file):
    name, info = camera_calibration_parsers.readCalibration(str(file))
    assert (name, info.width, info.height, info.distortion_model) == ("head_camera", 640, 480, "plumb_bob")
    assert np.array_equal(info.K, LAB.matrix.ravel())
    assert np.array_equal(info.D, LAB.distortion)
    assert np.array_equal(info.R, np.eye(3).ravel())
    assert np.array_equal(np.reshape(info.P, (3, 4))[:, :3], LAB.matrix)


def test_a_file_without_the_optional_distortion_model_is_read(file):
    file.write_text(file.read_text().replace("distortion_model: plumb_bob\n", ""))
    assert np.array_equal(load_camera(file).distortion, LAB.distortion)


@pytest.mark.parametrize(
    "old, new, reason",
    [
        ("plumb_bob", "equidistant", "distortion_model is 'equidistant', expected 'plumb_bob'"),
        ("image_width: 640\n", "", "key 'image_width' is missing"),
        ("image_height: 480", "image_height: tall", "holds something that is no number"),
        ("[617.73492686", "[-617.73492686", "expected fx, fy > 0"),
        ("[617.73492686, 0.0,", "[617.73492686,", "expected 9 finite numbers"),
    ],
)
def test_a_file_that_holds_no_camera_of_ours_is_refused_by_name(file, old, new, reason):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(CameraError, match=reason) as error:
        load_camera(file)
    assert str(file) in str(error.value)


def test_a_missing_file_and_a_folder_that_is_not_there_are_named(tmp_path):
    with pytest.raises(ResourceError, match="nowhere.yaml: cannot be read"):
        load_camera(tmp_path / "nowhere.yaml")
    with pytest.raises(CameraError, match="camera.yaml: cannot be written: No such file or directory"):
        save_camera(LAB, tmp_path / "nowhere" / "camera.yaml")
