// A session with the journal made up from a seed, and a model of what it must keep: scenes with all
// their states, names, and content.

#ifndef BD_TESTS_JOURNAL_SESSION_H
#define BD_TESTS_JOURNAL_SESSION_H

#include "tests/journal/kit.h"

#define SESSION_SCENES    2
#define SESSION_REVISIONS 512
#define SESSION_NAMES     3

struct model_scene {
    char id[16]; // "": not there
    uint64_t revision;
    uint64_t states[SESSION_REVISIONS];
    uint64_t content_seed;         // of what the newest snapshot needs; 0: nothing
    uint64_t names[SESSION_NAMES]; // revisions; 0: not set
};

struct model {
    struct model_scene scenes[SESSION_SCENES]; // in order of addition
};

struct session {
    uint64_t random;
    uint32_t salt;          // another one for each attempt: what failed must not come back as new
    struct model kept;      // what was acknowledged
    struct model in_flight; // and what is true if the last call came through
    struct bd_journal *journal;
};

void session_begin(struct session *session, uint64_t seed);

// One call, or a few that belong together, at random. With BD_ERR_OK `kept` is what `in_flight`
// was; otherwise the journal has to hold one of the two, or just the one if nothing may come
// through late.
enum bd_err session_step(struct session *session, struct bd_err_detail *detail);

// Whether the journal holds the model, to the last state that can be loaded and its content.
bool session_holds(struct bd_journal *journal, const struct model *model, char *why,
                   size_t why_bytes);

#endif
