"""Pictures out of bytes: every kind that a camera or a phone may hand over, and those that are none."""
import cv2
import numpy as np
import pytest

from dr_eureka.vision.pictures import PictureError, decode_picture

SMOOTH = cv2.resize(np.random.default_rng(3).integers(0, 256, (4, 6, 3), dtype=np.uint8), (60, 40))


def encoded(suffix, rgb=SMOOTH):
    return cv2.imencode(suffix, rgb[..., ::-1])[1].tobytes()


def turned_photo(orientation):
    """Return a JPEG with an EXIF orientation, written out by hand."""
    photo = encoded(".jpg")
    entry = b"\x01\x12\x00\x03\x00\x00\x00\x01" + bytes([0, orientation, 0, 0])
    tiff = b"MM\x00*\x00\x00\x00\x08" + b"\x00\x01" + entry + bytes(4)
    exif = b"Exif\x00\x00" + tiff
    return photo[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + photo[2:]


def test_a_png_comes_back_as_it_was():
    np.testing.assert_array_equal(decode_picture(encoded(".png")), SMOOTH)


def test_sixteen_bits_are_cut_to_eight_and_transparency_is_left_out():
    deep = cv2.imencode(".png", SMOOTH[..., ::-1].astype(np.uint16) * 256 + 200)[1].tobytes()
    np.testing.assert_array_equal(decode_picture(deep), SMOOTH)
    clear = np.dstack([SMOOTH[..., ::-1], np.full(SMOOTH.shape[:2], 128, np.uint8)])
    np.testing.assert_array_equal(decode_picture(cv2.imencode(".png", clear)[1].tobytes()), SMOOTH)


def test_grey_becomes_three_equal_channels():
    grey = SMOOTH[..., 0]
    decoded = decode_picture(cv2.imencode(".png", grey)[1].tobytes())
    np.testing.assert_array_equal(decoded, np.repeat(grey[..., None], 3, axis=2))


def test_a_photo_is_turned_as_its_exif_says():
    upright = decode_picture(turned_photo(1))
    np.testing.assert_array_equal(decode_picture(turned_photo(6)), np.rot90(upright, -1))
    np.testing.assert_array_equal(decode_picture(turned_photo(3)), np.rot90(upright, 2))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("data", [encoded(".png"), encoded(".jpg"), turned_photo(6)], ids=["png", "jpeg", "exif"])
def test_a_cut_off_picture_is_refused_wherever_it_ends(data, share):
    with pytest.raises(PictureError, match="cut off after"):
        decode_picture(data[: int(len(data) * share)])


def test_a_cut_off_photo_with_a_whole_thumbnail_is_still_cut_off():
    photo, thumbnail = encoded(".jpg"), encoded(".jpg", SMOOTH[::8, ::8])
    data = photo[:2] + b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail + photo[2:]
    assert decode_picture(data).shape == SMOOTH.shape
    with pytest.raises(PictureError, match="cut off"):
        decode_picture(data[:-20])


@pytest.mark.parametrize("data", [b"", b"\xff\xd8", b"plain text", b"GIF89a" + bytes(50), bytes(1000)])
def test_what_is_no_picture_is_refused(data):
    with pytest.raises(PictureError):
        decode_picture(data)
