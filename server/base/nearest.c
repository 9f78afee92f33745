#include "base/nearest.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

// No name of ours is longer, and no word that is means one of them.
#define LENGTH_MAX 40

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

// Letters to add, to drop, to change, or to swap with their neighbour (Damerau and Levenshtein).
static size_t distance(const char *a, size_t a_length, const char *b, size_t b_length)
{
    size_t rows[3][LENGTH_MAX + 1];
    size_t *before = rows[0], *last = rows[1], *row = rows[2];
    for (size_t j = 0; j <= b_length; j++) last[j] = before[j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            const size_t change = last[j - 1] + (a[i - 1] != b[j - 1]);
            row[j] = least(change, least(last[j], row[j - 1]) + 1);
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = least(row[j], before[j - 2] + 1);
        }
        size_t *spare = before;
        before = last;
        last = row;
        row = spare;
    }
    return last[b_length];
}

void bd_nearest_begin(struct bd_nearest *nearest, const char *word)
{
    *nearest = (struct bd_nearest){.word = word, .distance = SIZE_MAX};
}

void bd_nearest_consider(struct bd_nearest *nearest, const char *name)
{
    const size_t length = strlen(nearest->word), name_length = strlen(name);
    if (length == 0 || length > LENGTH_MAX || name_length > LENGTH_MAX) return;
    const size_t found = distance(nearest->word, length, name, name_length);
    // Of a short word one letter in three may be wrong: what is further off is another word.
    if (found > (length + 2) / 3 || found >= name_length || found >= nearest->distance) return;
    nearest->distance = found;
    nearest->name = name;
}

const char *bd_nearest_hint(const struct bd_nearest *nearest, char out[BD_NEAREST_HINT_BYTES])
{
    out[0] = 0;
    if (nearest->name)
        snprintf(out, BD_NEAREST_HINT_BYTES, "; did you mean \"%s\"?", nearest->name);
    return out;
}
