// Strength of light where one number must do. Not luminance: a picture with its channels exchanged
// must be the same picture with its channels exchanged, to the last bit; so the smaller two are
// added first, whichever they are.
float all_channels(vec3 rgb)
{
    float smaller = min(rgb.r, rgb.g), larger = max(rgb.r, rgb.g);
    return (min(smaller, rgb.b) + max(smaller, min(larger, rgb.b))) + max(larger, rgb.b);
}
