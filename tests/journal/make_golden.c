// Writes the journal that this version writes. usage: make_golden DIRECTORY

#include <stdio.h>

#include "tests/journal/story.h"

int main(int argc, char **argv)
{
    static struct story story;
    struct bd_journal *journal = NULL;
    struct bd_err_detail detail = {0};
    if (argc != 2) return 2;
    story_make(&story);
    enum bd_err err = bd_journal_open(argv[1], &journal, &detail);
    if (!err) err = story_write(&story, journal, &detail);
    if (err) fprintf(stderr, "%s\n", detail.message);
    bd_journal_close(&journal);
    story_free(&story);
    return err != BD_ERR_OK;
}
