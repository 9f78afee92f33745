// The tree of lights by itself: what it says of its probabilities is what it does, and nothing that
// can give light is left out.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "reference/light_tree.h"
#include "reference/sampler.h"
#include "tests/unit/cmocka_all.h"

#define LIGHTS_MAX 600

struct cloud {
    uint32_t count;
    struct bd_tree_light lights[LIGHTS_MAX];
};

// --- building -----------------------------------------------------------------------------------

// Uniform in [0, 1), by a count of what was asked so far.
static double uniform(uint64_t *state)
{
    return (double)(bd_mix64((*state)++) >> 11) * 0x1p-53;
}

static void unit_vector(uint64_t *state, float out[3])
{
    double z = 2 * uniform(state) - 1, phi = 2 * 3.14159265358979 * uniform(state);
    double r = sqrt(1 - z * z);
    out[0] = (float)(r * cos(phi)), out[1] = (float)(r * sin(phi)), out[2] = (float)z;
}

// Lights in heaps of different sizes, some faced alike, powers over six decades.
static void make_cloud(uint32_t count, bool is_lamps, uint64_t seed, struct cloud *cloud)
{
    uint64_t state = seed << 32;
    double heap[3] = {0}, width = 1;
    float facing[3] = {0, -1, 0};
    memset(cloud, 0, sizeof *cloud);
    cloud->count = count;
    for (uint32_t i = 0; i < count; i++) {
        struct bd_tree_light *light = &cloud->lights[i];
        if (i % 16 == 0) {
            for (int k = 0; k < 3; k++) heap[k] = uniform(&state) - 0.5;
            width = pow(10, -4 * uniform(&state));
            unit_vector(&state, facing);
        }
        double size = is_lamps ? 0 : 0.2 * width * uniform(&state);
        for (int k = 0; k < 3; k++) {
            light->low[k] = (float)(heap[k] + width * (uniform(&state) - 0.5));
            light->high[k] = light->low[k] + (float)(size * uniform(&state));
        }
        memcpy(light->axis, facing, sizeof facing);
        if (i % 3 == 0) unit_vector(&state, light->axis);
        if (is_lamps && i % 5 == 0) memset(light->axis, 0, sizeof light->axis);
        light->two_sided = !is_lamps && i % 4 == 1;
        light->power = pow(10, 6 * uniform(&state));
        light->reach.cosine = (float)cos(0.05 + 1.5 * uniform(&state));
        light->reach.range = i % 2 ? INFINITY : (float)(2 * uniform(&state));
    }
}

static struct bd_tree_light light_at(const void *user, uint32_t index)
{
    return ((const struct cloud *)user)->lights[index];
}

static struct bd_light_tree tree_of(const struct cloud *cloud, bool is_lamps)
{
    struct bd_light_tree tree;
    struct bd_err_detail detail = {0};
    if (bd_light_tree_init(&tree, cloud->count, is_lamps, light_at, cloud, &detail))
        fail_msg("%s", detail.message);
    return tree;
}

static struct bd_receiver receiver_at(uint64_t *state, int i)
{
    struct bd_receiver receiver = {.all_round = i % 5 == 4};
    double width = i % 3 ? 1.2 : 0.01;
    for (int k = 0; k < 3; k++) receiver.position[k] = (float)(width * (uniform(state) - 0.5));
    unit_vector(state, receiver.normal_geometric);
    memcpy(receiver.normal, receiver.normal_geometric, sizeof receiver.normal);
    if (i % 2) receiver.normal[0] += 0.1f;
    return receiver;
}

// One draw, its number left in `u`.
static uint32_t choose(const struct bd_light_tree *tree, const struct bd_receiver *receiver,
                       double *u, float *probability)
{
    struct bd_light_draw draw = {.u = *u};
    bd_light_tree_choose(tree, receiver, 1, &draw);
    *u = draw.u;
    *probability = draw.probability;
    return draw.light;
}

// --- probabilities ------------------------------------------------------------------------------

static double sum_of(const struct bd_light_tree *tree, const struct bd_receiver *receiver,
                     uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) sum += bd_light_tree_probability(tree, receiver, i);
    return sum;
}

static void probabilities_add_up(void **state)
{
    (void)state;
    static struct cloud cloud;
    const uint32_t counts[] = {1, 2, 3, 17, 100, LIGHTS_MAX};
    for (int c = 0; c < 12; c++) {
        bool is_lamps = c >= 6;
        make_cloud(counts[c % 6], is_lamps, (uint64_t)c + 1, &cloud);
        struct bd_light_tree tree = tree_of(&cloud, is_lamps);
        uint64_t random = 99;
        for (int i = 0; i < 60; i++) {
            const struct bd_receiver receiver = receiver_at(&random, i);
            assert_float_equal(sum_of(&tree, &receiver, cloud.count), 1, 1e-4);
        }
        assert_float_equal(sum_of(&tree, NULL, cloud.count), 1, 1e-4);
        bd_light_tree_finish(&tree);
    }
}

static void without_a_receiver_power_decides(void **state)
{
    (void)state;
    static struct cloud cloud;
    make_cloud(200, false, 5, &cloud);
    struct bd_light_tree tree = tree_of(&cloud, false);
    double sum = 0;
    for (uint32_t i = 0; i < cloud.count; i++) sum += cloud.lights[i].power;
    for (uint32_t i = 0; i < cloud.count; i++) {
        double expected = cloud.lights[i].power / sum;
        assert_float_equal(bd_light_tree_probability(&tree, NULL, i) / expected, 1, 1e-4);
    }
    bd_light_tree_finish(&tree);
}

// Drawn as often as it says; what is left of the random number is uniform.
static void it_draws_as_often_as_it_says(void **state)
{
    (void)state;
    static struct cloud cloud;
    enum { DRAWS = 1 << 17 };
    for (int c = 0; c < 8; c++) {
        uint64_t random = 7 + (uint64_t)c;
        uint32_t drawn[LIGHTS_MAX] = {0};
        double rest = 0;
        make_cloud(60, c % 2, random, &cloud);
        struct bd_light_tree tree = tree_of(&cloud, c % 2);
        const struct bd_receiver receiver = receiver_at(&random, c);
        for (uint32_t i = 0; i < DRAWS; i++) {
            double u = (i + uniform(&random)) / DRAWS;
            float probability;
            uint32_t light = choose(&tree, &receiver, &u, &probability);
            assert_in_range(light, 0, cloud.count - 1);
            assert_true(u >= 0 && u < 1);
            assert_true(probability == bd_light_tree_probability(&tree, &receiver, light));
            drawn[light]++;
            rest += u / DRAWS;
        }
        // By strata: each light's interval is hit as often as it is long, but for its two ends.
        for (uint32_t i = 0; i < cloud.count; i++) {
            double expected = DRAWS * (double)bd_light_tree_probability(&tree, &receiver, i);
            assert_true(fabs(drawn[i] - expected) <= 2 + 1e-4 * expected);
        }
        assert_float_equal(rest, 0.5, 0.005);
        bd_light_tree_finish(&tree);
    }
}

static void several_are_drawn_as_one_by_one(void **state)
{
    (void)state;
    static struct cloud cloud;
    uint64_t random = 17;
    for (int c = 0; c < 40; c++) {
        make_cloud(200, c % 2, (uint64_t)c, &cloud);
        struct bd_light_tree tree = tree_of(&cloud, c % 2);
        const struct bd_receiver receiver = receiver_at(&random, c);
        struct bd_light_draw several[8];
        double start = uniform(&random);
        for (int i = 0; i < 8; i++) several[i].u = (i + start) / 8;
        bd_light_tree_choose(&tree, &receiver, 8, several);
        for (int i = 0; i < 8; i++) {
            double u = (i + start) / 8;
            float probability;
            assert_int_equal(choose(&tree, &receiver, &u, &probability), several[i].light);
            assert_true(u == several[i].u && probability == several[i].probability);
        }
        bd_light_tree_finish(&tree);
    }
}

// --- nothing is left out ------------------------------------------------------------------------

static double dot(const float a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Whether a point of the light sends something to the receiver, told without a tree.
static bool is_sent(const struct bd_tree_light *light, const double at[3], bool is_lamp,
                    const struct bd_receiver *receiver)
{
    double back[3], toward[3], distance = 0;
    for (int k = 0; k < 3; k++) back[k] = receiver->position[k] - at[k];
    for (int k = 0; k < 3; k++) distance += back[k] * back[k];
    distance = sqrt(distance);
    for (int k = 0; k < 3; k++) toward[k] = -back[k];
    if (!receiver->all_round && dot(receiver->normal_geometric, toward) < 1e-5 * distance)
        return false;
    double cosine = dot(light->axis, back) / distance;
    if (light->two_sided) cosine = fabs(cosine);
    if (!is_lamp) return cosine > 1e-5;
    bool is_everywhere = light->axis[0] == 0 && light->axis[1] == 0 && light->axis[2] == 0;
    return distance < light->reach.range && (is_everywhere || cosine > light->reach.cosine);
}

static void nothing_that_gives_light_is_left_out(void **state)
{
    (void)state;
    static struct cloud cloud;
    uint32_t sent_count = 0, left_out_count = 0;
    for (int c = 0; c < 6; c++) {
        bool is_lamps = c % 2;
        uint64_t random = 1000 + (uint64_t)c;
        make_cloud(300, is_lamps, random, &cloud);
        struct bd_light_tree tree = tree_of(&cloud, is_lamps);
        for (int i = 0; i < 40; i++) {
            const struct bd_receiver receiver = receiver_at(&random, i);
            for (uint32_t l = 0; l < cloud.count; l++) {
                const struct bd_tree_light *light = &cloud.lights[l];
                double at[3];
                for (int k = 0; k < 3; k++)
                    at[k] =
                        light->low[k] + uniform(&random) * ((double)light->high[k] - light->low[k]);
                float probability = bd_light_tree_probability(&tree, &receiver, l);
                bool sent = is_sent(light, at, is_lamps, &receiver);
                if (sent) assert_true(probability > 0);
                sent_count += sent;
                left_out_count += probability == 0;
            }
        }
        bd_light_tree_finish(&tree);
    }
    // Both cases came up, or this tells nothing.
    assert_true(sent_count > 10000 && left_out_count > 10000);
}

// --- hard cases ---------------------------------------------------------------------------------

static void check_sums(const struct cloud *cloud, bool is_lamps)
{
    struct bd_light_tree tree = tree_of(cloud, is_lamps);
    uint64_t random = 3;
    for (int i = 0; i < 20; i++) {
        const struct bd_receiver receiver = receiver_at(&random, i);
        double u = uniform(&random);
        float probability;
        uint32_t light = choose(&tree, &receiver, &u, &probability);
        assert_true(probability > 0);
        assert_true(probability == bd_light_tree_probability(&tree, &receiver, light));
        assert_float_equal(sum_of(&tree, &receiver, cloud->count), 1, 1e-4);
    }
    bd_light_tree_finish(&tree);
}

static void hard_cases_stay_whole(void **state)
{
    (void)state;
    static struct cloud cloud;
    for (int is_lamps = 0; is_lamps < 2; is_lamps++) {
        make_cloud(100, is_lamps, 11, &cloud);
        for (uint32_t i = 1; i < 100; i++) cloud.lights[i] = cloud.lights[0]; // one place
        check_sums(&cloud, is_lamps);
        make_cloud(100, is_lamps, 12, &cloud);
        for (uint32_t i = 0; i < 100; i++) cloud.lights[i].power = pow(10, i % 76 - 38.0);
        check_sums(&cloud, is_lamps);
        for (uint32_t i = 0; i < 100; i++) // far away, or no number at all
            for (int k = 0; k < 3; k++) {
                float at = i == 7 ? NAN : i == 8 ? INFINITY : powf(10, (float)(i % 38));
                cloud.lights[i].low[k] = cloud.lights[i].high[k] = at;
            }
        check_sums(&cloud, is_lamps);
    }
}

static void the_powerless_are_never_drawn(void **state)
{
    (void)state;
    static struct cloud cloud;
    make_cloud(100, false, 13, &cloud);
    for (uint32_t i = 0; i < 100; i += 2) cloud.lights[i].power = i % 4 ? 0 : NAN;
    struct bd_light_tree tree = tree_of(&cloud, false);
    uint64_t random = 1;
    const struct bd_receiver receiver = receiver_at(&random, 1);
    assert_int_equal(tree.count, 50);
    assert_float_equal(sum_of(&tree, &receiver, 100), 1, 1e-4);
    for (uint32_t i = 0; i < 100; i += 2)
        assert_true(bd_light_tree_probability(&tree, &receiver, i) == 0);
    bd_light_tree_finish(&tree);
    for (uint32_t i = 0; i < 100; i++) cloud.lights[i].power = 0;
    tree = tree_of(&cloud, false);
    assert_int_equal(tree.count, 0);
    bd_light_tree_finish(&tree);
}

// A light of a billion times the power, which may be behind a wall, leaves the others their share.
static void weak_lights_keep_a_share(void **state)
{
    (void)state;
    static struct cloud cloud;
    make_cloud(64, true, 14, &cloud);
    for (uint32_t i = 0; i < 64; i++) {
        memset(cloud.lights[i].axis, 0, sizeof cloud.lights[i].axis);
        cloud.lights[i].power = i == 20 ? 1e9 : 1;
        cloud.lights[i].reach.range = INFINITY;
    }
    struct bd_light_tree tree = tree_of(&cloud, true);
    uint64_t random = 1;
    for (int i = 0; i < 20; i++) {
        struct bd_receiver receiver = receiver_at(&random, i);
        receiver.all_round = true;
        float strong = bd_light_tree_probability(&tree, &receiver, 20);
        assert_true(strong > 0.85f && strong < 1 - 0.99f * BD_LIGHT_SHARE_MIN);
    }
    bd_light_tree_finish(&tree);
}

// --- large ones ---------------------------------------------------------------------------------

// A row, each light as far from the last as all before it: planes part off one at a time.
static struct bd_tree_light in_a_row(const void *user, uint32_t index)
{
    (void)user;
    float at = ldexpf(1, (int)(index % 200) - 100);
    return (struct bd_tree_light){.low = {at, 0, 0}, .high = {at, 0, 0}, .power = 1};
}

static struct bd_tree_light of_a_screen(const void *user, uint32_t index)
{
    const uint32_t width = *(const uint32_t *)user;
    float x = (float)(index % width) / (float)width, y = (float)(index / width) / (float)width;
    return (struct bd_tree_light){.low = {x, y, 0},
                                  .high = {x + 1 / (float)width, y + 1 / (float)width, 0},
                                  .axis = {0, 0, 1},
                                  .power = 1 + index % 7};
}

static uint32_t deepest(const struct bd_light_tree *tree, uint32_t count)
{
    uint64_t deepest = 0;
    for (uint32_t i = 0; i < count; i++)
        deepest = tree->ways[i] > deepest ? tree->ways[i] : deepest;
    return deepest ? 64 - (uint32_t)__builtin_clzll(deepest) : 0;
}

static void large_trees_are_built(void **state)
{
    (void)state;
    const uint32_t width = 320, count = width * width;
    struct bd_light_tree tree;
    assert_int_equal(bd_light_tree_init(&tree, 100000, true, in_a_row, NULL, NULL), 0);
    assert_in_range(deepest(&tree, 100000), 17, 62);
    bd_light_tree_finish(&tree);
    assert_int_equal(bd_light_tree_init(&tree, count, false, of_a_screen, &width, NULL), 0);
    assert_in_range(deepest(&tree, count), 17, 32);
    const struct bd_receiver receiver = {
        .position = {0.3f, 0.4f, 0.2f}, .normal = {0, 0, -1}, .normal_geometric = {0, 0, -1}};
    assert_float_equal(sum_of(&tree, &receiver, count), 1, 1e-3);
    bd_light_tree_finish(&tree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(probabilities_add_up),
        cmocka_unit_test(without_a_receiver_power_decides),
        cmocka_unit_test(it_draws_as_often_as_it_says),
        cmocka_unit_test(several_are_drawn_as_one_by_one),
        cmocka_unit_test(nothing_that_gives_light_is_left_out),
        cmocka_unit_test(hard_cases_stay_whole),
        cmocka_unit_test(the_powerless_are_never_drawn),
        cmocka_unit_test(weak_lights_keep_a_share),
        cmocka_unit_test(large_trees_are_built),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
