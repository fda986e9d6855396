"""Pictures out of the bytes of a file or a message."""

from __future__ import annotations

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
_JPEG_SCAN, _JPEG_END = b"\xff\xda", b"\xff\xd9"


class PictureError(DrEurekaError):
    """Bytes that are no whole picture."""


def decode_picture(data: bytes) -> np.ndarray:
    """Return the picture in PNG, JPEG or other bytes that OpenCV knows as (height, width, 3) uint8 rgb.

    16-bit pictures are cut to 8, transparency is left out, and a photo is turned as its EXIF orientation says.

    Raises:
        PictureError: when the bytes cannot be decoded, or are a PNG or JPEG that is cut off.
    """
    if _cut_off(data):
        raise PictureError(f"picture is cut off after {len(data)} bytes")
    try:
        # cv2 answers an empty buffer and a picture beyond its limits with an exception, a broken one with None.
        bgr = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        bgr = None
    if bgr is None:
        raise PictureError("no picture that can be decoded; expected PNG, JPEG or the like")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def _cut_off(data: bytes) -> bool:
    """Tell whether the end of a PNG or JPEG is missing: OpenCV fills a JPEG up with grey and calls it good."""
    if data.startswith(_PNG):
        return b"IEND" not in data[len(_PNG):]
    # An embedded thumbnail has an end of its own, before the scan of the picture itself.
    return data.startswith(_JPEG) and data.rfind(_JPEG_END) < max(data.rfind(_JPEG_SCAN), len(_JPEG))
