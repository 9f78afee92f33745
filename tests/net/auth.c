// Token files: roles, prefixes, quotas, and what is refused.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "net/access/auth.h"
#include "net/loop/peer.h"

#include "../protocol/cmocka_all.h"

static enum bd_err read_text(const char *text, mode_t mode, struct bd_tokens **out,
                             struct bd_err_detail *detail)
{
    char path[] = "/tmp/bounced-auth-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    assert_int_equal(fchmod(fd, mode), 0);
    close(fd);
    enum bd_err err = bd_tokens_read(path, out, detail);
    unlink(path);
    return err;
}

static void bare_tokens_may_do_everything(void **state)
{
    (void)state;
    struct bd_tokens *tokens;
    assert_int_equal(read_text("# ours\n\n0123456789abcdef\n", 0600, &tokens, NULL), BD_ERR_OK);
    assert_true(bd_tokens_needed(tokens));
    const struct bd_grant *grant = bd_tokens_find(tokens, "0123456789abcdef");
    assert_non_null(grant);
    assert_int_equal(grant->role, BD_ROLE_ADMIN);
    assert_string_equal(grant->name, "token-3");
    assert_true(bd_grant_covers(grant, "anything"));
    assert_true(grant->scenes_max == UINT64_MAX);
    assert_null(bd_tokens_find(tokens, "0123456789abcdeF"));
    assert_null(bd_tokens_find(tokens, "0123456789abcde"));
    assert_null(bd_tokens_find(tokens, NULL));
    bd_tokens_destroy(&tokens);
}

static void words_behind_a_token(void **state)
{
    (void)state;
    struct bd_tokens *tokens;
    const char *text = "aaaaaaaaaaaaaaaa role=read scenes=shop/ name=viewer\r\n"
                       "bbbbbbbbbbbbbbbb\trole=edit max_scenes=3 max_bytes=2G max_jobs=1";
    assert_int_equal(read_text(text, 0600, &tokens, NULL), BD_ERR_OK);
    const struct bd_grant *viewer = bd_tokens_find(tokens, "aaaaaaaaaaaaaaaa");
    const struct bd_grant *editor = bd_tokens_find(tokens, "bbbbbbbbbbbbbbbb");
    assert_string_equal(viewer->name, "viewer");
    assert_true(bd_grant_covers(viewer, "shop/chair"));
    assert_false(bd_grant_covers(viewer, "shop"));
    assert_false(bd_grant_covers(viewer, ""));
    assert_true(viewer->bytes_max == UINT64_MAX);
    assert_true(editor->scenes_max == 3 && editor->jobs_max == 1);
    assert_true(editor->bytes_max == 2ull << 30);

    struct bd_err_detail detail;
    assert_int_equal(bd_grant_check_role(viewer, BD_ROLE_READ, &detail), BD_ERR_OK);
    assert_int_equal(bd_grant_check_role(viewer, BD_ROLE_EDIT, &detail), BD_ERR_FORBIDDEN);
    assert_string_equal(detail.field, "role");
    assert_string_equal(detail.message, "the role of \"viewer\" is read, and this asks for edit");
    assert_int_equal(bd_grant_check_role(editor, BD_ROLE_EDIT, &detail), BD_ERR_OK);
    assert_int_equal(bd_grant_check_role(editor, BD_ROLE_ADMIN, &detail), BD_ERR_FORBIDDEN);
    bd_tokens_destroy(&tokens);
}

static void what_looks_like_protection_and_is_none(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        mode_t mode;
        const char *field, *says;
    } bad[] = {
        {"", 0600, "token-file", "holds no entry"},
        {"# nothing\n", 0600, "token-file", "holds no entry"},
        {"short\n", 0600, "token-file", "line 1: a token has at least 16"},
        {"aaaaaaaaaaaaaaaa\naaaaaaaaaaaaaaaa role=read\n", 0600, "token-file",
         "line 2: this token"},
        {"aaaaaaaaaaaaaaaa role=root\n", 0600, "role", "line 1: a role is read, edit or admin"},
        {"aaaaaaaaaaaaaaaa rol=read\n", 0600, "token-file", "line 1: behind an entry"},
        {"aaaaaaaaaaaaaaaa read\n", 0600, "token-file", "line 1: behind an entry"},
        {"aaaaaaaaaaaaaaaa scenes=\n", 0600, "scenes", "1 to 127"},
        {"aaaaaaaaaaaaaaaa max_jobs=-1\n", 0600, "max_jobs", "whole number"},
        {"aaaaaaaaaaaaaaaa max_bytes=99999999999G\n", 0600, "max_bytes", "whole number"},
        {"aaaaaaaaaaaaaaaa\n", 0640, "token-file", "can be read by others"},
        {"uid:no-such-user-here\n", 0600, "uid", "line 1: this machine has no user \"no-such-"},
        {"gid:no-such-group-here\n", 0600, "gid", "line 1: this machine has no group \"no-su"},
        {"uid:\n", 0600, "uid", "no user \"\""},
        {"uid: 1000\n", 0600, "uid", "no user \"\""},
        {"UID:someone-who-is-not-here\n", 0600, "uid", "no user"}, // and no token
        {"gid:*\n", 0600, "gid", "no group"},
        {"uid:-1\n", 0600, "uid", "no user"},
        {"uid:4294967295\n", 0600, "uid", "no user"},
        {"uid:1000x\n", 0600, "uid", "no user"},
        {"uid:1000\ngid:1000\nuid:1000 role=read\n", 0600, "uid", "line 3: \"uid:1000\" is there"},
        {"uid:0\nuid:root\n", 0600, "uid", "line 2: \"uid:root\" is there already"},
        {"uid:*\nuid:*\n", 0600, "uid", "line 2: \"uid:*\" is there already"},
        {"uid:1000 rol=read\n", 0600, "token-file", "line 1: behind an entry"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct bd_tokens *tokens = NULL;
        struct bd_err_detail detail = {0};
        assert_int_equal(read_text(bad[i].text, bad[i].mode, &tokens, &detail), BD_ERR_USAGE);
        assert_string_equal(detail.field, bad[i].field);
        assert_non_null(strstr(detail.message, bad[i].says));
        assert_null(tokens);
    }
}

static void too_many(void **state)
{
    (void)state;
    char *text = calloc(257, 20), *at = text;
    for (int i = 0; i < 257; i++) at += sprintf(at, "%016d\n", i);
    struct bd_tokens *tokens = NULL;
    struct bd_err_detail detail;
    assert_int_equal(read_text(text, 0600, &tokens, &detail), BD_ERR_USAGE);
    assert_string_equal(detail.message, "line 257: there are more than 256 entries");
    free(text);
}

static const struct bd_grant *find(const struct bd_tokens *tokens, uid_t uid, gid_t first,
                                   gid_t second)
{
    gid_t groups[] = {first, second};
    const struct bd_peer peer = {.uid = uid, .groups = groups, .group_count = 2};
    return bd_tokens_find_peer(tokens, &peer, 500);
}

static void users_of_this_machine(void **state)
{
    (void)state;
    struct bd_tokens *tokens;
    const char *text = "gid:70 role=read\n"
                       "aaaaaaaaaaaaaaaa\n"
                       "uid:1000 role=edit scenes=shop/ max_jobs=2 name=anna\n"
                       "gid:80 role=edit\n"
                       "uid:root role=read\n";
    assert_int_equal(read_text(text, 0600, &tokens, NULL), BD_ERR_OK);
    assert_true(bd_tokens_needed(tokens) && bd_tokens_name_users(tokens));
    const struct bd_grant *anna = find(tokens, 1000, 70, 80);
    assert_string_equal(anna->name, "anna");
    assert_true(anna->role == BD_ROLE_EDIT && anna->jobs_max == 2);
    assert_true(bd_grant_covers(anna, "shop/x") && !bd_grant_covers(anna, "x"));
    // Of several groups the first line counts, whichever group is the user's own.
    assert_string_equal(find(tokens, 1001, 80, 70)->name, "gid:70");
    assert_string_equal(find(tokens, 1001, 90, 80)->name, "gid:80");
    assert_null(find(tokens, 1001, 90, 91));
    // The daemon's own user needs no line, and a line of one's own counts before that.
    assert_ptr_equal(find(tokens, 500, 70, 80), &bd_grant_of_all);
    assert_int_equal(find(tokens, 0, 0, 0)->role, BD_ROLE_READ);
    // A user is no token.
    assert_null(bd_tokens_find(tokens, "uid:1000"));
    assert_non_null(bd_tokens_find(tokens, "aaaaaaaaaaaaaaaa"));
    bd_tokens_destroy(&tokens);

    assert_int_equal(read_text("uid:* role=read\n", 0600, &tokens, NULL), BD_ERR_OK);
    assert_true(bd_tokens_needed(tokens)); // by HTTP and TCP there is no way in
    assert_null(bd_tokens_find(tokens, NULL));
    assert_string_equal(find(tokens, 7, 7, 7)->name, "uid:*");
    assert_ptr_equal(find(tokens, 0, 7, 7), &bd_grant_of_all);
    bd_tokens_destroy(&tokens);
}

static void no_file_needs_no_token(void **state)
{
    (void)state;
    struct bd_tokens *tokens;
    assert_int_equal(bd_tokens_read(NULL, &tokens, NULL), BD_ERR_OK);
    assert_false(bd_tokens_needed(tokens));
    assert_ptr_equal(bd_tokens_find(tokens, NULL), &bd_grant_of_all);
    assert_false(bd_tokens_name_users(tokens));
    assert_null(find(tokens, 1000, 1000, 1000));
    assert_ptr_equal(find(tokens, 500, 500, 500), &bd_grant_of_all);
    assert_ptr_equal(find(tokens, 0, 0, 0), &bd_grant_of_all);
    bd_tokens_destroy(&tokens);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bare_tokens_may_do_everything),
        cmocka_unit_test(words_behind_a_token),
        cmocka_unit_test(what_looks_like_protection_and_is_none),
        cmocka_unit_test(too_many),
        cmocka_unit_test(users_of_this_machine),
        cmocka_unit_test(no_file_needs_no_token),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
