"""Pictures small enough to lie in a page, as data URIs; all of a scene with one exposure."""
import base64
import io

import numpy

LUMINANCE = (0.2126, 0.7152, 0.0722)
BRIGHT_SHARE = 99  # per cent of the pixels that the brightest displayed value is above (E5)


def exposure_of(reference):
    """Factor that takes the reference's 99th percentile of luminance to white."""
    bright = numpy.percentile(numpy.nan_to_num(reference) @ LUMINANCE, BRIGHT_SHARE)
    return 1.0 / bright if bright > 0 else 1.0


def displayed(linear, exposure):
    """sRGB in 0 to 1; what is brighter than white is cut, what is no number is magenta."""
    good = numpy.isfinite(linear).all(axis=-1, keepdims=True)
    value = numpy.clip(numpy.nan_to_num(linear * exposure), 0, 1)
    curve = numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return numpy.where(good, curve, (1.0, 0.0, 1.0))


def jpeg_uri(linear, exposure):
    from matplotlib.image import imsave
    out = io.BytesIO()
    imsave(out, displayed(linear, exposure), format="jpg", pil_kwargs={"quality": 88})
    return data_uri("image/jpeg", out.getvalue())


def data_uri(kind, data):
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
