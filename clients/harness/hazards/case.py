"""One row on one technique: pictures, and what is asked of them.

Every picture is held to what holds for all of them: no NaN, no infinity, no negative light, a
report that counts no such pixel. What else holds is the row's to say.
"""

import numpy as np

from ..techniques import UNLIMITED
from .row import Failure, NotApplicable

LIGHT = ("beauty", "direct", "indirect", "emission")
PROBE_PX = 4  # a probe's side: its pixels see one point and so tell the noise, where there is any
# Blocks along the longer side, of techniques that light blocks: as many as they have by default, in
# pictures as small as these, are single pixels.
COARSEST = 8
SINGLE_PIXELS = {"coarsest": None}  # settings of a row that knows the light of each of them
SHARED_PX = 8  # pixels along a side of what may have its light, and its noise, in common
SAMPLES_FEW, SAMPLES_USUAL, SAMPLES_MANY = 4, 16, 512  # a pixel


def _blocks(values):
    """Means of blocks of a picture; of values that are none, or of a smaller one, themselves."""
    if values.ndim != 2 or min(values.shape) < SHARED_PX:
        return values
    rows, columns = (n // SHARED_PX for n in values.shape)
    whole = values[:rows * SHARED_PX, :columns * SHARED_PX]
    return whole.reshape(rows, SHARED_PX, columns, SHARED_PX).mean(axis=(1, 3))


class View:
    """A picture of a case."""

    def __init__(self, frame, command):
        self.frame, self.command, self.report = frame, command, frame.report

    def light(self, layer="beauty"):
        """height x width x 3, cd/m^2, in double precision."""
        return self.frame.layer(layer).astype(np.float64)

    def plane(self, name):
        return self.frame.planes[name]

    def irradiance(self, layer, albedo):
        """The red channel as E, lux, of Lambertian surfaces. Albedo has 16 bits: E is off by up to
        1.5e-5 (0.5 reads 0.5000076). Rows that ask for more compare two pictures."""
        return self.light(layer)[..., 0] * np.pi / albedo

    def covered(self):
        return self.plane("A") > 0

    def flags(self):
        return [flag.split(":")[0] for flag in self.report.get("flags", [])]


class Case:
    def __init__(self, daemon, technique, row, folder, full=False):
        self.daemon, self.technique, self.row, self.folder = daemon, technique, row, folder
        self.full = full
        self.flags, self.notes = [], []
        self._scene_count = 0

    @property
    def model(self):
        return self.technique.model

    # --- what the technique can do ---

    def needs(self, condition, reason):
        if not condition:
            raise NotApplicable(reason)

    def needs_indirect(self):
        self.needs(self.model.indirect_bounces > 0, "has no indirect light")

    def needs_choice(self, key, choice):
        has = choice in self.technique.parameters.get(key, {}).get("choices", [])
        self.needs(has, f"has no {key}={choice}")

    def needs_range(self, key, value):
        self.needs(self.technique.has(key), f"reads no {key}")
        self.needs(self.technique.parameters[key]["maximum"] >= value,
                   f"{key} ends below {value}")

    def bounces(self, wanted):
        """Settings under which it makes exactly `wanted` indirect bounces."""
        self.needs_indirect()
        if self.model.indirect_bounces == wanted:
            return {}
        key = "bounces" if self.technique.is_reference else "indirect_bounces"
        self.needs(self.model.indirect_bounces == UNLIMITED and self.technique.has(key),
                   f"cannot be held to {wanted} bounce{'s' if wanted > 1 else ''}")
        return {key: wanted}

    def settings(self, wanted, best, samples):
        """`wanted` on what every row starts from; `best` adds the ladder's top."""
        out = dict(self.technique.tolerance_settings)
        if self.technique.has("brdf"):
            out["brdf"] = "lambert"
        if best and self.technique.ladder and not self.technique.is_reference:
            out.update(self.technique.ladder[-1])
        if self.technique.has("coarsest"):
            out["coarsest"] = COARSEST
        for key in ("spp", "samples"):
            if self.technique.is_reference and self.technique.has(key):
                out[key] = samples or (SAMPLES_MANY if best else SAMPLES_USUAL)
        out.update(wanted or {})
        return {key: value for key, value in out.items() if value is not None}

    # --- pictures ---

    def save(self, scene, label=""):
        """Writes the scene beside the others of the row."""
        self._scene_count += 1
        name = label or (str(self._scene_count) if self._scene_count > 1 else "")
        path = self.folder / f"row{self.row.number:02}{'-' + name if name else ''}.glb"
        path.write_bytes(scene if isinstance(scene, bytes) else scene.glb())
        return path

    def shown(self, command):
        """A command as a person repeats it: scenes lie where --keep puts them."""
        return command.replace(str(self.folder), "DIR")

    def render(self, scene, size=(33, 33), camera=None, settings=None, best=False, samples=None,
               seed=0, layers=()):
        """`scene`: a Scene, or the path of one saved before."""
        path = scene if hasattr(scene, "exists") else self.save(scene)
        frame = self.daemon.render(path, self.technique.name,
                                   self.settings(settings, best, samples), size=size,
                                   camera=camera, layers=(*LIGHT, *layers), seed=seed)
        view = View(frame, frame.command)
        self._hold_always(view)
        return view

    def _hold_always(self, view):
        for name in LIGHT:
            light = view.light(name)
            bad = np.argwhere(~np.isfinite(light))
            if len(bad):
                raise Failure("finite light", f"{light[tuple(bad[0])]} in {name} at pixel "
                              f"{bad[0][1]},{bad[0][0]} and {len(bad) - 1} more", view.command)
            if light.min() < 0:
                at = np.unravel_index(light.argmin(), light.shape)
                raise Failure("no negative light", f"{light.min():.6g} in {name} at pixel "
                              f"{at[1]},{at[0]}", view.command)
        if view.report.get("nonfinite_pixels", 0) != 0:
            raise Failure("no non-finite pixel", f"{view.report['nonfinite_pixels']} of them",
                          view.command)

    def probe(self, scene, camera, layer, albedo=0.5, **how):
        """(E at a probe's point, its standard error, the view)."""
        view = self.render(scene, (PROBE_PX, PROBE_PX), camera, **how)
        e = view.irradiance(layer, albedo)
        return float(e.mean()), self.noise(e), view

    def noise(self, values):
        """Standard error of the mean of values with one expectation; 0 unless it is sampled. A
        technique that is must not use it to excuse dots."""
        if not self.technique.is_sampled or values.size < 2:
            return 0.0
        return float(values.std(ddof=1) / np.sqrt(values.size))

    # --- answers ---

    def fail(self, view, expected, seen):
        raise Failure(expected, seen, view.command)

    def expect(self, condition, view, expected, seen):
        if not condition:
            self.fail(view, expected, seen)

    def near(self, view, what, seen, expected, tolerance, noise=0.0):
        """`seen` within `tolerance` (relative) of `expected`, and four standard errors."""
        if not abs(seen - expected) <= tolerance * abs(expected) + 4 * noise:
            self.fail(view, f"{what} = {expected:.7g} within {tolerance:.2g}",
                      f"{seen:.7g} ({(seen / expected - 1) * 100:+.3g} %)")

    def flat(self, view, what, values, expected, tolerance):
        """Every value within `tolerance` of `expected`: of a sampled picture the mean, and no
        value beyond six of its own standard deviations."""
        if self.technique.is_sampled:
            self.near(view, f"mean {what}", values.mean(), expected, tolerance, self.noise(values))
            tolerance = tolerance + 6 * values.std() / expected
        worst = values.ravel()[np.abs(values - expected).argmax()]
        self.near(view, f"every {what}", worst, expected, tolerance)

    def dark(self, view, layer, where=None):
        """Exactly no light."""
        light = view.light(layer)
        light = light if where is None else light[where]
        if light.size and light.max() != 0:
            self.fail(view, f"{layer} exactly 0", f"{light.max():.6g} and light in "
                      f"{np.count_nonzero(light.max(axis=-1))} of {light[..., 0].size} pixels")

    def same(self, view, other, tolerance, layers=LIGHT, outliers=0.0, factor=1.0, where=None):
        """`view` is `factor` times `other`, to `tolerance` of the layer's largest value, but for a
        share `outliers` of the pixels. A sampled picture may differ by noise without bias."""
        for name in layers:
            seen = view.light(name)
            wanted = factor * other.light(name)
            if where is not None:
                seen, wanted = seen[where], wanted[where]
            scale = wanted.max(initial=0)
            off = np.abs(seen - wanted) > tolerance * scale
            share = off.any(axis=-1).mean() if off.size else 0.0
            if share <= outliers or self._is_noise(seen - wanted, tolerance * scale):
                continue
            worst = np.abs(seen - wanted).max() / scale if scale else seen.max()
            self.fail(view, f"{name} equal to {tolerance:.2g} of its largest value in all but "
                      f"{100 * outliers:g} % of the pixels", f"{100 * share:.3g} % differ, the "
                      f"worst by {worst:.3g}")

    def _is_noise(self, difference, allowed):
        if not self.technique.is_sampled:
            return False
        d = difference.mean(axis=-1)
        return abs(d.mean()) <= 4 * max(self.noise(d), self.noise(_blocks(d))) + allowed

    def flagged(self, view, *names):
        """The report says so by one of `names`."""
        found = [flag for flag in view.flags() if flag in names]
        self.expect(found, view, "the flag " + " or ".join(names),
                    ", ".join(view.flags()) or "no flag")
        self.flags += [flag for flag in found if flag not in self.flags]

    def note(self, text):
        self.notes.append(text)
