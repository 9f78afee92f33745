// Letters for the margins of pictures: a fixed font of 5 x 7 pixels with what scales need, digits
// and a few more; an unknown letter is blank. Any thread.

#ifndef BD_IMAGE_GLYPHS_H
#define BD_IMAGE_GLYPHS_H

#include <stdint.h>

#define BD_GLYPH_WIDTH_PX  6 // with the gap behind it
#define BD_GLYPH_HEIGHT_PX 7

struct bd_canvas {
    uint32_t width_px, height_px;
    uint8_t *rgb8; // three bytes a pixel, rows from the top
};

// Fills a rectangle, as far as it is on the canvas.
void bd_canvas_fill(const struct bd_canvas *canvas, uint32_t x_px, uint32_t y_px, uint32_t width_px,
                    uint32_t height_px, const uint8_t rgb[3]);

// The text's left upper corner is at (x, y); every pixel of a glyph is `scale` pixels wide and
// high.
void bd_canvas_text(const struct bd_canvas *canvas, uint32_t x_px, uint32_t y_px, uint32_t scale,
                    const char *text, const uint8_t rgb[3]);

#endif
