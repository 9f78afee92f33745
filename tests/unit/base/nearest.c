// What a misspelt name means, and that not everything means something.

#include <string.h>

#include "base/nearest.h"
#include "tests/unit/cmocka_all.h"

static const char *nearest_to(const char *word)
{
    static const char *const names[] = {"size", "set", "seed", "camera", "technique", "aa"};
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, word);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        bd_nearest_consider(&nearest, names[i]);
    return nearest.name ? nearest.name : "";
}

static void slips_are_understood(void **state)
{
    (void)state;
    assert_string_equal(nearest_to("siez"), "size");
    assert_string_equal(nearest_to("sizes"), "size");
    assert_string_equal(nearest_to("camra"), "camera");
    assert_string_equal(nearest_to("teqnique"), "technique");
    assert_string_equal(nearest_to("sed"), "set"); // the first of two that are as near
}

static void other_words_are_not(void **state)
{
    (void)state;
    const char *const words[] = {"", "x", "bb", "exposure", "techno", "camera_of_the_scene",
                                 "a-name-that-is-much-longer-than-any-of-ours-may-ever-be"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        assert_string_equal(nearest_to(words[i]), "");
}

static void the_hint_is_a_sentence(void **state)
{
    (void)state;
    char hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, "siez");
    assert_string_equal(bd_nearest_hint(&nearest, hint), "");
    bd_nearest_consider(&nearest, "size");
    assert_string_equal(bd_nearest_hint(&nearest, hint), "; did you mean \"size\"?");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(slips_are_understood),
                                       cmocka_unit_test(other_words_are_not),
                                       cmocka_unit_test(the_hint_is_a_sentence)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
