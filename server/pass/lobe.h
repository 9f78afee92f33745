// The glTF BRDF of a receiver as rays need it: what light from a direction gives, and directions of
// the specular lobe with their density. Private to pass/.
//
// Heitz 2018 (visible normals).
//
// Thread: any.

#ifndef BD_PASS_LOBE_H
#define BD_PASS_LOBE_H

#include "pass/area_samples.h"
#include "pass/receivers.h"

struct bd_lobe {
    const struct bd_area_receiver *at;
    bool lambert, is_there; // a lobe that is worth its price
    float alpha, view_cosine, view_root;
};

// A pixel of a part whose surfaces and starts of rays are known; a number of it for a sequence of
// one a pixel is its place. False behind the part's end, and where nothing is lit.
bool bd_lobe_receiver_at(const struct bd_receiver_part *part, uint32_t group, uint32_t lane,
                         struct bd_area_receiver *out);

struct bd_lobe bd_lobe_of(const struct bd_area_receiver *at, bool lambert);

// What a unit of radiance from there gives, per steradian.
struct bd_area_light_found bd_lobe_received(const struct bd_lobe *lobe, f3 direction);
// Of it what the specular lobe gives, of a dielectric.
float bd_lobe_specular(const struct bd_lobe *lobe, f3 direction);
// Whether light from there comes to the surface's front.
bool bd_lobe_is_above(const struct bd_lobe *lobe, f3 direction);

// The viewer's direction mirrored at a visible normal, and its density per steradian.
f3 bd_lobe_choose(const struct bd_lobe *lobe, const float number[2]);
float bd_lobe_pdf(const struct bd_lobe *lobe, f3 direction);

#endif
