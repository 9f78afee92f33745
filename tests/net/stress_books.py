"""What the stress test knows: each scene's log, what clients were told of it, and whether the two agree."""
import threading


class Past:
    """One scene's log, as far as anybody has read it, and what clients were told of it."""

    def __init__(self, scene, mesh):
        self.scene, self.mesh = scene, mesh
        self.lock = threading.Lock()
        self.entries = {}  # by revision
        self.told = []     # (revision, hash, client_edit_id or None)
        self.last = 0

    def tell(self, revision, digest, edit_id=None):
        with self.lock:
            self.told.append((revision, digest, edit_id))

    def read(self, entries):
        """Names come and go; the rest of an entry never changes."""
        with self.lock:
            for entry in entries:
                fixed = (entry.kind, entry.client_edit_id, entry.message, entry.hash, entry.of)
                assert self.entries.setdefault(entry.revision, fixed) == fixed, entry

    def check(self):
        with self.lock:
            told, self.told = self.told, []
        for revision, digest, edit_id in told:
            assert revision <= self.last, f"revision {revision} was shown, the journal has {self.last}"
            if revision not in self.entries:
                continue  # compacted before it was read
            _, known_id, _, known_hash, _ = self.entries[revision]
            assert digest == known_hash, f"revision {revision} is {known_hash}, and was shown as {digest}"
            assert edit_id is None or edit_id == known_id, f"revision {revision}: {edit_id}, {known_id}"
        self._check_order()

    def _check_order(self):
        edit_ids = [entry[1] for entry in self.entries.values() if entry[1]]
        assert len(edit_ids) == len(set(edit_ids)), "an edit is there twice"
        for revision, (kind, _, _, digest, of) in self.entries.items():
            # An undo undoes `of`, a redo the undo `of`: the state before it is there again.
            wanted = {"undo": of - 1, "redo": of - 1, "revert": of}.get(kind)
            if wanted in self.entries:
                assert digest == self.entries[wanted][3], f"revision {revision}, {kind} of {of}"

    def intensity(self):
        """Of light 0: only durable edits, which say it in their message, touch it. None: not known."""
        values = {1: None}
        for revision in range(2, self.last + 1):
            kind, _, message, _, of = self.entries.get(revision, ("?",) * 5)
            if kind in ("undo", "redo"):
                values[revision] = values[of - 1]
            elif kind == "revert":
                values[revision] = values[of]
            elif kind == "?":
                return None
            else:
                values[revision] = float(message) if message else values[revision - 1]
        return values[self.last]


class World:
    def __init__(self):
        self.pasts = {}
        self.failures = []
        self.is_over = False   # no new requests: wait for the answers
        self.is_ending = False # connections may break
        self.answered = self.resumed = self.edit_count = self.phase = 0
        self.lock = threading.Lock()

    def fail(self, what):
        self.failures.append(what)
        self.is_over = True

    def next_edit(self):
        with self.lock:
            self.edit_count += 1
            return self.edit_count
