// Relative luminance of linear RGB with the primaries of sRGB.
float luminance(vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }
