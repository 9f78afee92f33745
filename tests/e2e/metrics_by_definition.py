"""The metrics of bounce compare, slowly, from their definitions: two-dimensional kernels in double.

Shares no code with it. Pictures are height x width x 3, scene-linear. SSIM: Wang et al. 2004. FLIP:
Andersson et al., HPG 2020; HDR-FLIP: Andersson et al., Eurographics short papers 2021.
"""
import numpy


def filtered(plane, kernel):
    """Convolution without flipping; beyond an edge its last sample repeats."""
    radius = kernel.shape[0] // 2
    padded = numpy.pad(plane, radius, mode="edge")
    windows = numpy.lib.stride_tricks.sliding_window_view(padded, kernel.shape)
    return numpy.einsum("yxij,ij->yx", windows, kernel)


def grid(radius):
    return numpy.meshgrid(numpy.arange(-radius, radius + 1), numpy.arange(-radius, radius + 1))


# --- display ----------------------------------------------------------------------------------

def luminance(rgb):
    return rgb @ [0.2126, 0.7152, 0.0722]


def curve(x):
    x = numpy.maximum(x, 0)
    x = 0.6 * x
    return numpy.minimum(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1)


def srgb(linear):
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def shown(reference, image):
    """Both, display-linear, exposed so that the 99th percentile of the reference is 1."""
    ranks = numpy.sort(luminance(reference).ravel())
    exposure = 1 / ranks[int(0.99 * (ranks.size - 1))]
    return curve(exposure * reference), curve(exposure * image)


def psnr(reference, image):
    a, b = map(srgb, shown(reference, image))
    return -10 * numpy.log10(numpy.mean((a - b) ** 2))


def ssim(reference, image):
    a, b = (luminance(srgb(side)) for side in shown(reference, image))
    x, y = grid(5)
    window = numpy.exp(-(x ** 2 + y ** 2) / (2 * 1.5 ** 2))
    window /= window.sum()
    mean_a, mean_b = filtered(a, window), filtered(b, window)
    var_a = filtered(a * a, window) - mean_a ** 2
    var_b = filtered(b * b, window) - mean_b ** 2
    cov = filtered(a * b, window) - mean_a * mean_b
    c1, c2 = 0.01 ** 2, 0.03 ** 2
    values = ((2 * mean_a * mean_b + c1) * (2 * cov + c2)
              / ((mean_a ** 2 + mean_b ** 2 + c1) * (var_a + var_b + c2)))
    return values[5:-5, 5:-5].mean()


# --- FLIP -------------------------------------------------------------------------------------

PPD = 0.7 * 3840 / 0.7 * numpy.pi / 180
XYZ_FROM_RGB = numpy.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                            [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                            [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = XYZ_FROM_RGB.sum(axis=1)


def opponent(rgb):
    x, y, z = numpy.moveaxis(rgb @ XYZ_FROM_RGB.T / WHITE, -1, 0)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def rgb_of_opponent(achromatic, red_green, blue_yellow):
    y = (achromatic + 16) / 116
    xyz = numpy.stack([y + red_green / 500, y, y - blue_yellow / 200], axis=-1) * WHITE
    return xyz @ numpy.linalg.inv(XYZ_FROM_RGB).T


def hunt_lab(rgb):
    ratio = rgb @ XYZ_FROM_RGB.T / WHITE
    delta = 6 / 29
    x, y, z = numpy.moveaxis(numpy.where(ratio > delta ** 3, numpy.cbrt(ratio),
                                         ratio / (3 * delta ** 2) + 4 / 29), -1, 0)
    lightness = 116 * y - 16
    return numpy.stack([lightness, 0.01 * lightness * 500 * (x - y),
                        0.01 * lightness * 200 * (y - z)], axis=-1)


def sensitivity(a1, b1, a2=0, b2=1e-5):
    x, y = grid(int(numpy.ceil(3 * numpy.sqrt(0.04 / (2 * numpy.pi ** 2)) * PPD)))
    squared = (x ** 2 + y ** 2) / PPD ** 2
    kernel = sum(a * numpy.sqrt(numpy.pi / b) * numpy.exp(-numpy.pi ** 2 * squared / b)
                 for a, b in ((a1, b1), (a2, b2)))
    return kernel / kernel.sum()


def detector(point):
    sigma = 0.5 * 0.082 * PPD
    x, y = grid(int(numpy.ceil(3 * sigma)))
    kernel = numpy.exp(-(x ** 2 + y ** 2) / (2 * sigma ** 2)) * (
        x ** 2 / sigma ** 2 - 1 if point else -x)
    return numpy.where(kernel < 0, kernel / -kernel[kernel < 0].sum(),
                       kernel / kernel[kernel > 0].sum())


def features(achromatic, point):
    kernel, plane = detector(point), (achromatic + 16) / 116
    return numpy.hypot(filtered(plane, kernel), filtered(plane, kernel.T))


def seen(rgb):
    planes = opponent(rgb)
    blurred = [filtered(plane, sensitivity(*constants)) for plane, constants in
               zip(planes, ((1, 0.0047), (1, 0.0053), (34.1, 0.04, 13.5, 0.025)))]
    lab = hunt_lab(numpy.clip(rgb_of_opponent(*blurred), 0, 1))
    return lab, features(planes[0], False), features(planes[0], True)


def distance(a, b):
    difference = a - b
    return (abs(difference[..., 0]) + numpy.hypot(difference[..., 1], difference[..., 2])) ** 0.7


def flip_map(reference, image):
    """Of display-linear pictures."""
    (lab_r, edge_r, point_r), (lab_i, edge_i, point_i) = seen(reference), seen(image)
    largest = distance(hunt_lab(numpy.array([0., 1, 0])), hunt_lab(numpy.array([0., 0, 1])))
    colour, knee = distance(lab_r, lab_i), 0.4 * largest
    colour = numpy.where(colour < knee, 0.95 / knee * colour,
                         0.95 + (colour - knee) / (largest - knee) * 0.05)
    feature = numpy.maximum(abs(edge_r - edge_i), abs(point_r - point_i)) / numpy.sqrt(2)
    return colour ** (1 - numpy.sqrt(feature))


def flip(reference, image):
    return flip_map(*shown(reference, image)).mean()


def hdr_flip(reference, image):
    light = luminance(reference)
    # 0.36 * 2.51 x^2 + 0.018 x = 0.85 (0.36 * 2.43 x^2 + 0.354 x + 0.14)
    bright = max(numpy.roots([0.36 * (2.51 - 0.85 * 2.43), 0.018 - 0.85 * 0.354, -0.85 * 0.14]))
    start, stop = numpy.log2(bright / light.max()), numpy.log2(bright / numpy.median(light))
    count = max(2, int(numpy.ceil(stop - start)))
    maps = [flip_map(curve(2 ** e * reference), curve(2 ** e * image))
            for e in numpy.linspace(start, stop, count)]
    errors = numpy.sort(numpy.max(maps, axis=0).ravel())[::-1]
    half = numpy.searchsorted(numpy.cumsum(errors), errors.sum() / 2)
    return errors.mean(), errors[half]


# --- sums -------------------------------------------------------------------------------------

def sums(a, b, i1, i2):
    """The figures that are sums over samples, by name; halves alike where a side has none."""
    reference, image, noise = (a + b) / 2, (i1 + i2) / 2, ((a - b) + (i1 - i2)) / 2
    mean, error = abs(reference.mean()), abs(image - reference)
    debiased, floor = (i1 - a) * (i2 - b), 0.01 * mean
    pixel = error.mean(axis=-1) / (abs(reference).mean(axis=-1) + floor)
    rmse = numpy.sqrt(max(debiased.mean(), 0))
    smape = 2 / (abs(image) + abs(reference) + floor)
    ranks = numpy.sort(pixel.ravel())
    return {
        "rel_rmse": rmse / mean, "rmse_max": rmse / reference.max(),
        "rel_mse": (debiased / (numpy.maximum(reference, floor) ** 2 + floor ** 2)).mean(),
        "mape": (error / (abs(reference) + floor)).mean(), "smape": (error * smape).mean(),
        "mape_floor": (abs(noise) / (abs(reference) + floor)).mean(),
        "smape_floor": (abs(noise) * smape).mean(),
        "signed_error": (image.mean() - reference.mean()) / mean,
        "noise_floor": numpy.sqrt((noise ** 2).mean()) / mean,
        "p99": ranks[int(numpy.ceil(0.99 * ranks.size)) - 1],
        "p999": ranks[int(numpy.ceil(0.999 * ranks.size)) - 1],
        "over_half": (pixel > 0.5).mean(), "max_rel": ranks[-1], "max_abs": error.max(),
        "mean_square": debiased.mean(), "mean_image": image.mean(),
        "mean_reference": reference.mean(), "nonfinite": 0,
    }
