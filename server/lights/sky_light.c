#include "lights/sky_light.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

static float brightest(const float rgb[3])
{
    return fmaxf(rgb[0], fmaxf(rgb[1], rgb[2]));
}

static const float *texel(const struct bd_sky_map *map, int64_t x, int64_t y)
{
    const int64_t width = map->width_px, height = map->height_px;
    x = x < 0 ? x + width : x >= width ? x - width : x;
    y = y < 0 ? 0 : y >= height ? height - 1 : y;
    return map->rgb + 3 * (size_t)(y * width + x);
}

// --- cells --------------------------------------------------------------------------------------

// The mean over a texel of what bilinear filtering shows there: nowhere 0 where something shows.
static double mean_of_texel(const struct bd_sky_map *map, int64_t x, int64_t y)
{
    static const double weight[3] = {0.125, 0.75, 0.125};
    double sum = 0;
    for (int dy = 0; dy < 3; dy++)
        for (int dx = 0; dx < 3; dx++)
            sum += weight[dy] * weight[dx] * brightest(texel(map, x + dx - 1, y + dy - 1));
    return sum;
}

static uint32_t first_of(uint32_t cell, uint32_t cells, uint32_t texels)
{
    return (uint32_t)((uint64_t)cell * texels / cells);
}

// Brightness at the corners of a cell that lies between the middles of four texels, where filtering
// is linear along both axes.
struct corners {
    float at[2][2]; // row, column
};

static struct corners corners_of(const struct bd_sky_light *sky, uint32_t column, uint32_t row)
{
    struct corners b;
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < 2; x++)
            b.at[y][x] = brightest(texel(sky->map, (int64_t)column - 1 + x, (int64_t)row - 1 + y));
    return b;
}

static float mean_of(const struct corners *b)
{
    return 0.25f * (b->at[0][0] + b->at[0][1] + b->at[1][0] + b->at[1][1]);
}

static double sum_of_block(const struct bd_sky_light *sky, uint32_t column, uint32_t row)
{
    const struct bd_sky_map *map = sky->map;
    const uint32_t right = first_of(column + 1, sky->columns, map->width_px);
    const uint32_t below = first_of(row + 1, sky->rows, map->height_px);
    double sum = 0;
    for (uint32_t y = first_of(row, sky->rows, map->height_px); y < below; y++) {
        const double solid = cos(y * pi / map->height_px) - cos((y + 1) * pi / map->height_px);
        for (uint32_t x = first_of(column, sky->columns, map->width_px); x < right; x++)
            sum += solid * mean_of_texel(map, x, y);
    }
    return sum;
}

static double row_edge(const struct bd_sky_light *sky, uint32_t row)
{
    const double height = sky->map->height_px;
    if (sky->in_blocks) return pi * first_of(row, sky->rows, sky->map->height_px) / height;
    return pi * fmin(fmax(row - 0.5, 0), height) / height;
}

static double column_edge(const struct bd_sky_light *sky, uint32_t column)
{
    const double width = sky->map->width_px;
    if (sky->in_blocks) return 2 * pi * first_of(column, sky->columns, sky->map->width_px) / width;
    return 2 * pi * (column - 0.5) / width;
}

static double sum_of_cell(const struct bd_sky_light *sky, uint32_t column, uint32_t row)
{
    if (sky->in_blocks) return sum_of_block(sky, column, row);
    const struct corners b = corners_of(sky, column, row);
    return mean_of(&b) * (cos(row_edge(sky, row)) - cos(row_edge(sky, row + 1)));
}

// Sums up to each as parts of all; returns the sum.
static double cumulate(double *values, uint32_t count, float *cumulated)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) values[i] = sum += values[i];
    for (uint32_t i = 0; i < count; i++)
        cumulated[i] = (float)(sum > 0 ? values[i] / sum : (i + 1.0) / count);
    cumulated[count - 1] = 1;
    return sum;
}

static enum bd_err fill(struct bd_sky_light *sky, double *row, double *sums,
                        enum bd_err (*pause)(void *user), void *user)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t y = 0; !err && y < sky->rows; y++) {
        for (uint32_t x = 0; x < sky->columns; x++) row[x] = sum_of_cell(sky, x, y);
        sums[y] = cumulate(row, sky->columns, sky->cumulated + (size_t)y * sky->columns);
        err = pause(user);
    }
    if (!err) sky->shines = cumulate(sums, sky->rows, sky->cumulated_rows) > 0;
    return err;
}

static void size_cells(struct bd_sky_light *sky)
{
    sky->columns = sky->map->width_px;
    sky->rows = sky->map->height_px;
    sky->in_blocks = (uint64_t)sky->columns * sky->rows > BD_SKY_CELLS_MAX;
    if (!sky->in_blocks) sky->rows++; // those at the poles are half as high
    while (sky->in_blocks && (uint64_t)sky->columns * sky->rows > BD_SKY_CELLS_MAX) {
        sky->columns = (sky->columns + 1) / 2;
        sky->rows = (sky->rows + 1) / 2;
    }
}

static enum bd_err make_cells(struct bd_sky_light *sky, enum bd_err (*pause)(void *user),
                              void *user, struct bd_err_detail *detail)
{
    size_cells(sky);
    sky->cumulated_rows = malloc(sky->rows * sizeof *sky->cumulated_rows);
    sky->cumulated = malloc((size_t)sky->columns * sky->rows * sizeof *sky->cumulated);
    double *row = malloc(sky->columns * sizeof *row), *sums = malloc(sky->rows * sizeof *sums);
    enum bd_err err = BD_ERR_OK;
    if (!sky->cumulated_rows || !sky->cumulated || !row || !sums)
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "environment", "no memory for %ux%u cells",
                         sky->columns, sky->rows);
    if (!err) err = fill(sky, row, sums, pause, user);
    free(row);
    free(sums);
    return err;
}

enum bd_err bd_sky_light_init(struct bd_sky_light *sky, const struct bd_environment *environment,
                              enum bd_err (*pause)(void *user), void *user,
                              struct bd_err_detail *detail)
{
    const float *factor = environment->radiance;
    sky->radiance = f3_of(factor[0], factor[1], factor[2]);
    sky->shines = factor[0] > 0 || factor[1] > 0 || factor[2] > 0;
    if (!sky->shines || !environment->map) return BD_ERR_OK;
    sky->map = bd_sky_map_retain(environment->map);
    sky->is_turned = bd_environment_is_turned(environment);
    bd_environment_axes(environment, sky->axes);
    return make_cells(sky, pause, user, detail);
}

void bd_sky_light_finish(struct bd_sky_light *sky)
{
    bd_sky_map_release(&sky->map);
    free(sky->cumulated_rows);
    free(sky->cumulated);
}

// --- directions ---------------------------------------------------------------------------------

static bd_dvec3 in_map(const struct bd_sky_light *sky, f3 direction)
{
    const bd_dvec3 d = {direction.x, direction.y, direction.z}, *axes = sky->axes;
    if (!sky->is_turned) return d;
    return (bd_dvec3){bd_dvec3_dot(d, axes[0]), bd_dvec3_dot(d, axes[1]), bd_dvec3_dot(d, axes[2])};
}

static bd_dvec3 in_world(const struct bd_sky_light *sky, bd_dvec3 d)
{
    if (!sky->is_turned) return d;
    return bd_dvec3_add(
        bd_dvec3_add(bd_dvec3_scale(sky->axes[0], d.x), bd_dvec3_scale(sky->axes[1], d.y)),
        bd_dvec3_scale(sky->axes[2], d.z));
}

// Column and row in parts of the map.
static void place_of(const struct bd_sky_light *sky, f3 direction, double *x, double *y)
{
    const bd_dvec3 d = in_map(sky, direction);
    double turn = atan2(d.x, -d.z);
    if (turn < 0) turn += 2 * pi;
    *x = fmin(turn / (2 * pi), 1);
    // The arc cosine would lose half of the digits near the zenith.
    *y = atan2(sqrt(d.x * d.x + d.z * d.z), d.y) / pi;
}

// At a place of the map.
static f3 radiance_at(const struct bd_sky_light *sky, double x, double y)
{
    const struct bd_sky_map *map = sky->map;
    x = x * map->width_px - 0.5;
    y = y * map->height_px - 0.5;
    const int64_t left = (int64_t)floor(x), top = (int64_t)floor(y);
    const float s = (float)(x - (double)left), t = (float)(y - (double)top);
    const float *a = texel(map, left, top), *b = texel(map, left + 1, top);
    const float *c = texel(map, left, top + 1), *d = texel(map, left + 1, top + 1);
    float rgb[3];
    for (int k = 0; k < 3; k++) {
        const float upper = a[k] + (b[k] - a[k]) * s, lower = c[k] + (d[k] - c[k]) * s;
        rgb[k] = upper + (lower - upper) * t;
    }
    return f3_mul(sky->radiance, f3_of(rgb[0], rgb[1], rgb[2]));
}

f3 bd_sky_light_radiance(const struct bd_sky_light *sky, f3 direction)
{
    if (!sky->map) return sky->radiance;
    double x, y;
    place_of(sky, direction, &x, &y);
    return radiance_at(sky, x, y);
}

uint32_t bd_cumulated_at(const float *cumulated, uint32_t count, float number)
{
    uint32_t low = 0, high = count - 1;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (cumulated[middle] > number)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

static float pdf(const float *cumulated, uint32_t at)
{
    return cumulated[at] - (at ? cumulated[at - 1] : 0);
}

// Where between the cells of a place and the next.
static double within(const float *cumulated, uint32_t at, float number)
{
    const float before = at ? cumulated[at - 1] : 0, share = pdf(cumulated, at);
    return share > 0 ? fmin(fmax((number - before) / share, 0), 1) : 0.5;
}

// Within a cell a direction's place is uniform along the azimuth, and along the angle from the
// zenith; `share` of it lies there, of a cell between texels in proportion to its brightness.
static float pdf_at(const struct bd_sky_light *sky, uint32_t column, uint32_t row, double s,
                    double t)
{
    const double top = row_edge(sky, row), bottom = row_edge(sky, row + 1);
    const double across = column_edge(sky, column + 1) - column_edge(sky, column);
    const double sine = fmax(sin(top + (bottom - top) * t), 1e-9);
    double share = 1;
    if (!sky->in_blocks) {
        const struct corners b = corners_of(sky, column, row);
        const double above = b.at[0][0] + (b.at[0][1] - b.at[0][0]) * s;
        const double below = b.at[1][0] + (b.at[1][1] - b.at[1][0]) * s;
        const float mean = mean_of(&b);
        share = mean > 0 ? (above + (below - above) * t) / mean : 0;
    }
    return (float)(pdf(sky->cumulated_rows, row) *
                   (double)pdf(sky->cumulated + (size_t)row * sky->columns, column) * share /
                   (across * (bottom - top) * sine));
}

// Where a number falls whose pdf goes from a at 0 to b at 1.
static double along_line(double number, double a, double b)
{
    const double root = sqrt((1 - number) * a * a + number * b * b);
    return a + root > 0 ? fmin(number * (a + b) / (a + root), 1) : number;
}

f3 bd_sky_light_choose(const struct bd_sky_light *sky, const float number[2], float *pdf)
{
    const uint32_t row = bd_cumulated_at(sky->cumulated_rows, sky->rows, number[1]);
    const float *columns = sky->cumulated + (size_t)row * sky->columns;
    const uint32_t column = bd_cumulated_at(columns, sky->columns, number[0]);
    double s = within(columns, column, number[0]), t = within(sky->cumulated_rows, row, number[1]);
    if (!sky->in_blocks) {
        const struct corners b = corners_of(sky, column, row);
        t = along_line(t, b.at[0][0] + b.at[0][1], b.at[1][0] + b.at[1][1]);
        s = along_line(s, b.at[0][0] + (b.at[1][0] - b.at[0][0]) * t,
                       b.at[0][1] + (b.at[1][1] - b.at[0][1]) * t);
    }
    const double top = row_edge(sky, row), left = column_edge(sky, column);
    const double angle = top + (row_edge(sky, row + 1) - top) * t;
    const double turn = left + (column_edge(sky, column + 1) - left) * s;
    if (pdf) *pdf = pdf_at(sky, column, row, s, t);
    const bd_dvec3 d =
        in_world(sky, (bd_dvec3){sin(angle) * sin(turn), cos(angle), -sin(angle) * cos(turn)});
    return f3_of((float)d.x, (float)d.y, (float)d.z);
}

static uint32_t cell_of(uint32_t place, uint32_t cells, uint32_t texels)
{
    uint32_t cell = (uint32_t)((uint64_t)place * cells / texels);
    while (cell + 1 < cells && first_of(cell + 1, cells, texels) <= place) cell++;
    return cell;
}

static float pdf_at_place(const struct bd_sky_light *sky, double x, double y)
{
    const struct bd_sky_map *map = sky->map;
    const double across = x * map->width_px, down = y * map->height_px;
    if (sky->in_blocks) {
        const uint32_t column = (uint32_t)fmin(across, map->width_px - 1.0);
        const uint32_t row = (uint32_t)fmin(down, map->height_px - 1.0);
        const uint32_t cell = cell_of(row, sky->rows, map->height_px);
        const double top = row_edge(sky, cell);
        return pdf_at(sky, cell_of(column, sky->columns, map->width_px), cell, 0.5,
                      (y * pi - top) / (row_edge(sky, cell + 1) - top));
    }
    const double column = floor(across + 0.5);
    const uint32_t row = (uint32_t)fmin(floor(down + 0.5), map->height_px);
    const double top = row_edge(sky, row), t = (y * pi - top) / (row_edge(sky, row + 1) - top);
    return pdf_at(sky, (uint32_t)column % sky->columns, row, across + 0.5 - column,
                  fmin(fmax(t, 0), 1));
}

struct bd_sky_look bd_sky_light_look(const struct bd_sky_light *sky, f3 direction)
{
    if (!sky->map) return (struct bd_sky_look){sky->radiance, 0};
    double x, y;
    place_of(sky, direction, &x, &y);
    return (struct bd_sky_look){radiance_at(sky, x, y), pdf_at_place(sky, x, y)};
}
