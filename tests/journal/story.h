// One small journal with something of everything, the same whenever it is made: the golden file,
// and what the tests of damage damage.

#ifndef BD_TESTS_JOURNAL_STORY_H
#define BD_TESTS_JOURNAL_STORY_H

#include "tests/journal/kit.h"

#define STORY_REVISIONS 12 // of scene "a"; "b" has half of them
#define STORY_CONTENTS  3

struct story {
    struct kit_edit a[STORY_REVISIONS + 2], b[STORY_REVISIONS + 2]; // by revision; and one more
    struct kit_content content[STORY_CONTENTS];
};

void story_make(struct story *story);
void story_free(struct story *story);
enum bd_err story_write(struct story *story, struct bd_journal *journal,
                        struct bd_err_detail *detail);

// Of what the journal holds, nothing is wrong, whatever is missing: scenes at the states of their
// revisions, edits, names and content as they were written. Otherwise `why`.
bool story_is_true(const struct story *story, struct bd_journal *journal, char *why,
                   size_t why_bytes);
// And nothing is missing.
bool story_is_whole(const struct story *story, struct bd_journal *journal, char *why,
                    size_t why_bytes);

#endif
