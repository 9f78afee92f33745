// Every statement that the journal runs again and again: prepared once, when it is opened.

#ifndef BD_SCENE_JOURNAL_JOURNAL_SQL_H
#define BD_SCENE_JOURNAL_JOURNAL_SQL_H

#define EDIT_HEAD                                                                                  \
    "revision,kind,of,client_edit_id,message,time_ms,snapshot_sha256,summary,payload_chk,chk,author"
#define EDIT_ALL     EDIT_HEAD ",answer,forward_content,inverse_content,forward,inverse"
#define SNAPSHOT_ALL "revision,sha256,content,chk,bytes"

// X(NAME, text). `scene` of every table but scenes is that table's id.
#define BD_SQL_MAP(X)                                                                              \
    X(BEGIN, "BEGIN IMMEDIATE")                                                                    \
    X(COMMIT, "COMMIT")                                                                            \
    X(ROLLBACK, "ROLLBACK")                                                                        \
    X(ADD_SCENE,                                                                                   \
      "INSERT INTO scenes(scene,name,added_ms,revision,chk,owner) VALUES(?1,?2,?3,?4,?5,?6)")      \
    X(FIND_SCENE, "SELECT scene,name,added_ms,revision,chk,id,owner FROM scenes WHERE scene=?1")   \
    X(NEXT_SCENE, "SELECT scene,name,added_ms,revision,chk,id,owner FROM scenes WHERE id>?1"       \
                  " ORDER BY id LIMIT 1")                                                          \
    X(SET_REVISION, "UPDATE scenes SET revision=?2,chk=?3 WHERE id=?1")                            \
    X(REMOVE_SCENE, "DELETE FROM scenes WHERE id=?1")                                              \
    X(ADD_EDIT, "INSERT INTO edits(scene," EDIT_ALL ")"                                            \
                " VALUES(?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16,?17)")             \
    X(GET_EDIT, "SELECT " EDIT_ALL " FROM edits WHERE scene=?1 AND revision=?2")                   \
    X(FIND_EDIT, "SELECT " EDIT_ALL " FROM edits WHERE scene=?1 AND client_edit_id=?2"             \
                 " AND client_edit_id<>''")                                                        \
    X(EDITS_AFTER, "SELECT " EDIT_ALL " FROM edits WHERE scene=?1 AND revision>?2"                 \
                   " AND revision<=?3 ORDER BY revision")                                          \
    X(EDIT_HEADS, "SELECT " EDIT_HEAD " FROM edits WHERE scene=?1 AND revision>=?2"                \
                  " ORDER BY revision")                                                            \
    X(LOG_START, "SELECT min(revision) FROM (SELECT revision FROM edits WHERE scene=?1"            \
                 " AND revision>?2 ORDER BY revision DESC LIMIT ?3)")                              \
    X(COUNT_EDITS, "SELECT count(*) FROM edits WHERE scene=?1 AND revision>?2 AND revision<=?3")   \
    X(EDIT_SHA256, "SELECT snapshot_sha256 FROM edits WHERE scene=?1 AND revision=?2")             \
    X(ADD_SNAPSHOT, "INSERT OR REPLACE INTO snapshots(scene," SNAPSHOT_ALL ")"                     \
                    " VALUES(?1,?2,?3,?4,?5,?6)")                                                  \
    X(SNAPSHOT_BEFORE, "SELECT " SNAPSHOT_ALL " FROM snapshots WHERE scene=?1 AND revision<=?2"    \
                       " ORDER BY revision DESC LIMIT 1")                                          \
    X(SNAPSHOT_REVISION, "SELECT max(revision) FROM snapshots WHERE scene=?1"                      \
                         " AND revision BETWEEN 1 AND ?2")                                         \
    X(CUT_EDITS, "DELETE FROM edits WHERE scene=?1 AND revision>?2")                               \
    X(CUT_SNAPSHOTS, "DELETE FROM snapshots WHERE scene=?1 AND revision>?2")                       \
    X(CUT_NAMES, "DELETE FROM names WHERE scene=?1 AND revision>?2")                               \
    X(SET_NAME, "INSERT INTO names(scene,name,revision,chk) VALUES(?1,?2,?3,?4)"                   \
                " ON CONFLICT(scene,name) DO UPDATE SET revision=?3,chk=?4")                       \
    X(REMOVE_NAME, "DELETE FROM names WHERE scene=?1 AND name=?2")                                 \
    X(NAMES, "SELECT name,revision,chk FROM names WHERE scene=?1 ORDER BY revision,name")          \
    X(BEGIN_CONTENT, "INSERT INTO contents(sha256,size,is_whole) VALUES(?1,?2,0)"                  \
                     " ON CONFLICT(sha256) DO UPDATE SET size=?2,is_whole=0")                      \
    X(FIND_CONTENT, "SELECT id,size,is_whole FROM contents WHERE sha256=?1")                       \
    X(FINISH_CONTENT, "UPDATE contents SET is_whole=1 WHERE sha256=?1")                            \
    X(PUT_PART, "INSERT OR REPLACE INTO parts(content,part,bytes) VALUES(?1,?2,?3)")               \
    X(GET_PART, "SELECT bytes FROM parts WHERE content=?1 AND part=?2")                            \
    X(NEXT_CONTENT, "SELECT id,sha256 FROM contents WHERE id>?1 ORDER BY id LIMIT 1")              \
    X(REMOVE_CONTENT, "DELETE FROM contents WHERE id=?1")                                          \
    X(REMOVE_PARTS, "DELETE FROM parts WHERE id IN"                                                \
                    " (SELECT id FROM parts WHERE content=?1 LIMIT ?2)")                           \
    X(NEXT_SNAPSHOT_LIST, "SELECT id,content FROM snapshots WHERE id>?1 ORDER BY id LIMIT ?2")     \
    X(NEXT_EDIT_LIST, "SELECT id,forward_content,inverse_content FROM edits WHERE id>?1"           \
                      " ORDER BY id LIMIT ?2")                                                     \
    X(FORGET_EDITS, "DELETE FROM edits WHERE id IN (SELECT id FROM edits"                          \
                    " WHERE scene=?1 AND revision>?2 AND revision<=?3 LIMIT ?4)")                  \
    X(FORGET_SNAPSHOTS, "DELETE FROM snapshots WHERE id IN (SELECT id FROM snapshots"              \
                        " WHERE scene=?1 AND revision>?2 AND revision<=?3 LIMIT ?4)")              \
    X(FORGET_NAMES, "DELETE FROM names WHERE id IN (SELECT id FROM names"                          \
                    " WHERE scene=?1 LIMIT ?2)")                                                   \
    X(NEXT_NAMED, "SELECT min(revision) FROM names WHERE scene=?1 AND revision>?2")                \
    X(NEXT_OF_EDITS, "SELECT min(scene) FROM edits WHERE scene>?1")                                \
    X(NEXT_OF_SNAPSHOTS, "SELECT min(scene) FROM snapshots WHERE scene>?1")                        \
    X(NEXT_OF_NAMES, "SELECT min(scene) FROM names WHERE scene>?1")                                \
    X(SCENE_EXISTS, "SELECT count(*) FROM scenes WHERE id=?1")                                     \
    X(UNFINISH_CONTENT, "UPDATE contents SET is_whole=0 WHERE id=?1")                              \
    X(GET_STATE, "SELECT identity,sequence,chk FROM state WHERE id=1")                             \
    X(SET_STATE, "INSERT OR REPLACE INTO state(id,identity,sequence,chk) VALUES(1,?1,?2,?3)")      \
    X(FREE_PAGES, "PRAGMA freelist_count")                                                         \
    X(PAGES, "PRAGMA page_count")                                                                  \
    X(VACUUM, "PRAGMA incremental_vacuum(256)")                                                    \
    X(COUNTS, "SELECT (SELECT count(*) FROM scenes),(SELECT count(*) FROM edits),"                 \
              "(SELECT count(*) FROM snapshots),count(*),total(size) FROM contents")

enum bd_journal_sql {
#define X(name, text) BD_SQL_##name,
    BD_SQL_MAP(X)
#undef X
        BD_SQL_COUNT
};

extern const char *const bd_journal_sql_texts[BD_SQL_COUNT];

#endif
