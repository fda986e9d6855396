import numpy as np
import pytest

from dr_eureka.vision.camera import CameraError, CameraModel


def plumb_bob(points, camera):
    """The published distortion equations, written out."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([u, v]) @ camera.matrix[:2, :2].T + camera.matrix[:2, 2]


@pytest.fixture
def points():
    rng = np.random.default_rng(0)
    return np.column_stack([rng.uniform(-0.25, 0.25, (50, 2)), rng.uniform(0.6, 1.2, 50)])


@pytest.mark.parametrize("distorted", [False, True])
def test_projection_follows_the_published_equations(points, distorted):
    camera = CameraModel.lab(distorted)
    assert np.allclose(camera.project(points), plumb_bob(points, camera), atol=1e-9)


@pytest.mark.parametrize("distorted", [False, True])
def test_rays_look_through_the_pixels_that_points_project_to(points, distorted):
    camera = CameraModel.lab(distorted)
    rays = camera.rays(camera.project(points).reshape(5, 10, 2))
    assert rays.shape == (5, 10, 3)
    assert np.allclose(rays.reshape(-1, 3), points / points[:, 2:], atol=1e-6)


def test_points_behind_the_camera_have_no_pixel():
    pixels = CameraModel.lab().project(np.array([[0.0, 0.0, 1.0], [0.1, 0.1, 0.0], [0.1, 0.1, -1.0]]))
    assert np.allclose(pixels[0], (301.59321376, 238.79976856))
    assert np.isnan(pixels[1:]).all()


def test_undistortion_puts_a_point_where_the_camera_without_distortion_sees_it():
    camera = CameraModel.lab(distorted=True)
    point = np.array([0.2, 0.15, 0.6])
    rows, columns = np.indices((480, 640))
    seen = camera.project(point)
    blob = np.exp(-((columns - seen[0]) ** 2 + (rows - seen[1]) ** 2) / 18)
    straight = camera.undistort((255 * blob).astype(np.uint8)).astype(float)
    centre = np.array([(straight * columns).sum(), (straight * rows).sum()]) / straight.sum()
    expected = camera.without_distortion().project(point)
    assert np.linalg.norm(seen - expected) > 3
    assert np.allclose(centre, expected, atol=0.2)


def test_an_image_without_distortion_is_handed_back_unchanged():
    image = np.random.default_rng(1).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    assert CameraModel.lab().undistort(image) is image


def test_an_image_of_another_size_is_refused():
    with pytest.raises(CameraError, match=r"\(240, 320, 3\), expected 480 rows x 640 columns"):
        CameraModel.lab(distorted=True).undistort(np.zeros((240, 320, 3), np.uint8))


@pytest.mark.parametrize(
    "matrix, distortion",
    [
        (np.zeros((3, 3)), np.zeros(5)),
        (np.full((3, 3), np.nan), np.zeros(5)),
        (np.diag([600.0, -600.0, 1.0]), np.zeros(5)),
        (np.diag([600.0, 600.0, 0.0]), np.zeros(5)),
        (np.eye(2), np.zeros(5)),
        (np.diag([600.0, 600.0, 1.0]), [0, 0, np.inf, 0, 0]),
        (np.diag([600.0, 600.0, 1.0]), np.zeros(8)),
    ],
)
def test_what_no_calibrated_camera_has_is_refused(matrix, distortion):
    with pytest.raises(CameraError):
        CameraModel(640, 480, matrix, distortion)


def test_missing_distortion_coefficients_are_zero():
    camera = CameraModel(640, 480, np.diag([600.0, 600.0, 1.0]), [0.1, 0.2, 0.0, 0.0])
    assert camera.distortion.tolist() == [0.1, 0.2, 0.0, 0.0, 0.0]
    assert not camera.without_distortion().is_distorted
