"""Pictures small enough to lie in a page, as data URIs; all of a scene with one exposure."""
import base64
import io

import numpy

LUMINANCE = (0.2126, 0.7152, 0.0722)
KEY = 0.18          # grey that the log mean of luminances is shown as
BRIGHT_SHARE = 99.5  # per cent of the pixels that are darker than what becomes white


def exposure_of(reference):
    """(factor, white): what takes the reference's log mean to KEY, and the brightest value then."""
    luminance = numpy.nan_to_num(reference) @ LUMINANCE
    lit = luminance[luminance > 0]
    if lit.size == 0:
        return 1.0, 1.0
    factor = KEY / float(numpy.exp(numpy.log(lit).mean()))
    return factor, max(1.0, float(numpy.percentile(lit, BRIGHT_SHARE)) * factor)


def displayed(linear, exposure):
    """sRGB in 0 to 1 by the tone curve of Reinhard et al. 2002; what is no number is magenta."""
    factor, white = exposure
    good = numpy.isfinite(linear).all(axis=-1, keepdims=True)
    value = numpy.clip(numpy.nan_to_num(linear) * factor, 0, white)
    value = value * (1 + value / white ** 2) / (1 + value)
    value = numpy.clip(value, 0, 1)
    curve = numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return numpy.where(good, curve, (1.0, 0.0, 1.0))


def jpeg_uri(linear, exposure):
    from matplotlib.image import imsave
    out = io.BytesIO()
    imsave(out, displayed(linear, exposure), format="jpg", pil_kwargs={"quality": 88})
    return data_uri("image/jpeg", out.getvalue())


def data_uri(kind, data):
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"
