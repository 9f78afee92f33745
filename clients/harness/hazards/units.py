"""Rows about numbers inside a stage that no picture shows. A technique that declares one of the
codes needs a unit test: its name goes here, or `bounce stability` fails for that technique."""
from .row import unit_row

unit_row(17, "exponent of a Phong lobe", "IP",  # glTF's are GGX's, whose width takes its place
         "tests/native/lobes.c:narrow_lobes_are_finite")
unit_row(40, "ray through the map's own centre", "P",
         "tests/pass/env_maps.c:rays_through_a_centre_meet_what_lies_ahead")
unit_row(41, "probability 0 of a cluster", "I",
         "tests/native/project.c:counts_are_exact_in_the_mean")
unit_row(42, "counts that do not sum up", "I",
         "tests/native/project.c:sums_are_exact_for_any_pattern")
unit_row(45, "depth in few bits", "I", "tests/lights/microbuffer.c:keys_are_in_order")
unit_row(56, "approximate reciprocals", "",
         "tests/analytic/form_factor.c:clipped_quads_match_the_integral")
