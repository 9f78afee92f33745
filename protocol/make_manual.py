"""protocol/manual.md: what goes over the wire, from the schema's comments, the daemon's tables and its help texts.

usage: make_manual.py SOURCE_ROOT BOUNCE BOUNCED > protocol/manual.md
"""
import json
import pathlib
import re
import subprocess
import sys
import textwrap

RULER = re.compile(r"// --- (.+?) -+$")
MESSAGE = re.compile(r"message (\w+) \{$")
FIELD = re.compile(r" +(?:(optional|repeated) )?(\w+) (\w+) = \d+(?: \[[^]]*\])?;(?: *// (.*))?$")
COMMENT = re.compile(r"( *)//(?: (.*))?$")
BEHIND = 8  # columns from which on a comment goes on behind a field, and is none above the next one

# The commands' table, the table of errors, and that of limits.
ROW = re.compile(r"\{BD_BODY\((\w+)\)(.*?)\},\n", re.S)
ERROR = re.compile(r'X\(\w+, "(\w+)", (\d+), (\d+)\)(?: +/\* (.*?) \*/)?')
LIMIT = re.compile(r"/\*(.*?)\*/|X\((\w+), ([^,]+), ([^,]+), ([^)]+)\)")
UNITS = {"BD_MIB": "(1 << 20)", "BD_GIB": "(1 << 30)", "ull": ""}


def told(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout


# --- the schema ---


def new_field(match, above, group):
    label, kind, name, behind = match.groups()
    return {"name": name, "type": kind, "repeated": label == "repeated", "group": group,
            "what": " ".join(line for line in [*above, behind] if line)}


def message_of(name, comment, lines):
    """Takes its lines, to the end. In a oneof a comment at the start, or behind an empty line, names a group."""
    fields, above, group, in_oneof, begins = [], [], "", False, False
    for line in lines:
        comment_line, field = COMMENT.match(line), FIELD.match(line)
        if line == "}":
            break
        if line.startswith("  oneof ") or line == "  }":
            in_oneof = begins = line != "  }"
            group = ""
        elif line == "":
            begins = in_oneof
        elif field:
            if begins and above:
                group, above = " ".join(above), []
            fields.append(new_field(field, above, group))
            above, begins = [], False
        elif line.startswith("  reserved "):  # numbers of what is gone
            above = []
        elif comment_line and len(comment_line[1]) > BEHIND:
            fields[-1]["what"] += " " + comment_line[2]
        elif comment_line:
            above.append(comment_line[2] or "")
        else:
            sys.exit(f"{name}: not understood: {line}")
    return {"name": name, "comment": comment, "fields": fields}


def sections_of(schema):
    """A comment that a message follows is the message's; another one behind a ruler is the section's."""
    sections, comment = [], []
    lines = iter(schema.splitlines())
    for line in lines:
        ruler, message, words = RULER.match(line), MESSAGE.match(line), COMMENT.match(line)
        if ruler:
            sections.append({"name": ruler[1].capitalize(), "prose": [], "messages": []})
        elif message:
            sections[-1]["messages"].append(message_of(message[1], comment, lines))
            comment = []
        elif words:
            comment.append(words[2] or "")
        elif sections:
            sections[-1]["prose"] += comment
            comment = []
        else:
            comment = []
    return sections


# --- the tables ---


def rows_of(folder):
    """By body: role, whether it is a job, whether its payload counts, method and path. A row stands with its steps."""
    rows = {}
    sources = (path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.c")))
    for body, words in (found for source in sources for found in ROW.findall(source)):
        role, http = re.search(r"BD_ROLE_(\w+)", words), re.search(r'\.http = "([^"]+)"', words)
        rows[body.lower()] = {
            "role": role[1].lower() if role else "read",
            "is_job": ".is_job = true" in words,
            "has_payload": ".has_payload = true" in words,
            "http": f"`{http[1]}`" if http else "",
        }
    return rows


def number_of(expression):
    for word, value in UNITS.items():
        expression = expression.replace(word, value)
    if not re.fullmatch(r"[\d\s*<()-]+", expression):
        sys.exit(f"no number: {expression}")
    return eval(expression)


def number_text(name, number):
    """As --limit takes it: what is counted in millions by powers of 1024."""
    for suffix, shift in (("G", 30), ("M", 20), ("K", 10)):
        if number and number % (1 << shift) == 0 and re.search("bytes|pixels|texels", name):
            return f"{number >> shift}{suffix}"
    return str(number)


def limits_of(header):
    """(name, default, least, most, what); comments stand before the first of those that they are about."""
    body = header[header.index("#define BD_LIMIT_MAP"):header.index("struct bd_limits")]
    comments, limits = [], []
    for comment, name, *numbers in LIMIT.findall(body.replace("\\\n", " ")):
        if comment:
            comments.append(comment.strip())
        else:
            texts = (number_text(name, number_of(number)) for number in numbers)
            limits.append((name, *texts, " ".join(comments) or "as above"))
            comments = []
    return limits


def options_of(text):
    """(option, what) of a help text, whose second column goes on in lines that begin with nothing else."""
    options = []
    for line in text.splitlines():
        begins = re.match(r"  (--?\S.*?)(?: {2,}(.*))?$", line)
        if begins:
            options.append([begins[1], begins[2] or ""])
        elif options and line.startswith(" " * 20):
            options[-1][1] = f"{options[-1][1]} {line.strip()}".strip()
        else:
            options.append(["", ""])  # no option's any more
    return [option for option in options if option[0]]


def frame_options_of(text, fields):
    """(name, value, default, what) of options that are fields of FrameRequest."""
    for option, what in options_of(text):
        words = option.split()
        name = words[0].lstrip("-").replace("-", "_")
        if name not in fields:
            continue
        what, _, default = what.partition(" (default ")
        also = re.sub(r"^or --([\w-]+): ", lambda match: f"also `{match[1].replace('-', '_')}`: ", what)
        yield f"`{name}`", f"`{words[1]}`" if len(words) > 1 else "", default.removesuffix(")"), also


def flags_of(text):
    behind = text[text.index("\nFlags of frames"):].splitlines()[2:]
    return [line.split(None, 1) for line in behind if line.startswith("  ")]


def default_of(field, text):
    """Only the text for people has it."""
    takes, what = re.escape(field["takes"]), re.escape(field["help"])
    found = re.search(rf"^ +{field['name']} +{takes}, default (.*): {what}$", text, re.M)
    return found[1] if found else ""


# --- what is printed ---


def anchor(title):
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def link(title):
    return f"[{title}](#{anchor(title)})"


def say(text, indent=""):
    print(textwrap.fill(text, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False))


def table(head, rows):
    rows = list(rows)
    if not rows:
        sys.exit(f"a table without rows: {head}")
    print("|", " | ".join(head), "|")
    print("|" + "---|" * len(head))
    for row in rows:
        print("|", " | ".join(cell.replace("|", "\\|") for cell in row), "|")
    print()


def prose(lines):
    """Its empty lines are kept, but at the ends."""
    text = "\n".join(lines).strip("\n")
    if text:
        print(text + "\n")


def type_of(field, known):
    kind = link(field["type"]) if field["type"] in known else field["type"]
    return f"repeated {kind}" if field["repeated"] else kind


def request_parts(field):
    """Answer, payload and HTTP of a request, as its comment has them: "`answer`; payload: ... HTTP: ..."."""
    text, _, http = field["what"].partition(" HTTP: ")
    answer, _, payload = text.rstrip(".").partition("; payload: ")
    return answer.rstrip("."), payload.rstrip("."), http


def print_requests(fields, rows):
    cells = []
    for field in fields:
        answer, payload, http = request_parts(field)
        row = rows.get(field["name"])
        if row and row["has_payload"] != bool(payload):
            sys.exit(f"{field['name']}: schema and table differ about its payload")
        named = f"{link(field['type'])} `{field['name']}`"
        cells.append((named, answer, row["role"] if row else "–", "yes" if row and row["is_job"] else "", payload,
                      row["http"] if row and row["http"] else http))
    table(("request", "answer", "role", "job", "payload", "HTTP"), cells)
    say("Role –: the connection's own, for every role unless its message says otherwise. `ID` is the message's `scene`, or its "
        "`id`; other fields are the query's of a `GET`, the body's of a `POST`. A job counts for `jobs_per_client` and a token's "
        "`max_jobs`.")
    print()


def print_envelope(message, rows):
    """Its oneof by groups: requests by the commands' table, too."""
    groups = dict.fromkeys(field["group"] for field in message["fields"] if field["group"])
    for group in groups:
        title, _, what = group.partition(": ")
        fields = [field for field in message["fields"] if field["group"] == group]
        print(f"### {title}\n")
        say(what[0].upper() + what[1:].rstrip(".") + ".")
        print()
        if title == "Requests":
            print_requests(fields, rows)
        else:
            table(("body", "what"), [(f"{link(field['type'])} `{field['name']}`", field["what"]) for field in fields])


def print_message(message, known):
    print(f"### {message['name']}\n")
    prose(message["comment"])
    fields = [field for field in message["fields"] if not field["group"]]
    if fields:
        table(("field", "type", "what"), [(f"`{field['name']}`", type_of(field, known), field["what"]) for field in fields])


def print_section(section, known, rows):
    print(f"## {section['name']}\n")
    prose(section["prose"])
    for message in section["messages"]:
        print_message(message, known)
        if message["name"] == "Envelope":
            print_envelope(message, rows)


def print_operations(kinds, text):
    print(text.split("\n\n")[1] + "\n")
    for kind in sorted(kinds, key=lambda kind: kind["kind"]):
        print(f"### Of a{'n' if kind['kind'][0] in 'aeiou' else ''} {kind['kind']}\n")
        table(("operation", "what"), [(f"`{one['name']}`", one["help"]) for one in kind["operations"]])
        table(("field", "takes", "default", "what"),
              [(f"`{field['name']}`", field["takes"], default_of(field, text), field["help"]) for field in kind["fields"]])


def print_frame_options(sections, text):
    fields = {field["name"] for section in sections for message in section["messages"] if message["name"] == "FrameRequest"
              for field in message["fields"]}
    say("Fields of FrameRequest, by one name in queries and in Python, and with dashes on the command line. What they take stands "
        "behind the last colon.")
    print()
    table(("option", "value", "default", "what"), frame_options_of(text, fields))


def print_limits(header):
    say("`bounced --limit NAME=VALUE` sets one, HelloReply tells them all, and every refusal names the one that was passed. "
        "K, M and G are powers of 1024.")
    print()
    table(("limit", "default", "from", "to", "what it bounds"),
          [(f"`{name}`", *row) for name, *row in limits_of(header)])


def print_errors(header):
    table(("code", "exit code of `bounce`", "HTTP status", "what"),
          [(f"`{code}`", *row) for code, *row in ERROR.findall(header)])


def print_tables(sections, root, bounce, bounced):
    operations, render = told(bounce, "edit", "--help-ops"), told(bounce, "render", "--help")
    print("## Operations of edits\n")
    print_operations(json.loads(told(bounce, "edit", "--help-ops", "--json")), operations)
    print("## Frame options\n")
    print_frame_options(sections, render)
    print("## Flags\n")
    table(("flag", "what"), [(f"`{name}`", what) for name, what in flags_of(render)])
    print("## Limits\n")
    print_limits((root / "protocol/limits.h").read_text(encoding="utf-8"))
    print("## Error codes\n")
    print_errors((root / "server/base/err.h").read_text(encoding="utf-8"))
    print("## Options of the daemon\n")
    print("```\n" + told(bounced, "--help").rstrip() + "\n```")


TABLES = ("Operations of edits", "Frame options", "Flags", "Limits", "Error codes", "Options of the daemon")


def check_anchors(sections):
    messages = [message["name"] for section in sections for message in section["messages"]]
    titles = [*TABLES, *messages, *(section["name"] for section in sections)]
    twice = {title for title in titles if sum(anchor(title) == anchor(other) for other in titles) > 1}
    if twice:
        sys.exit(f"two places of one name: {', '.join(sorted(twice))}")


def print_contents(sections):
    print("## Contents\n")
    for section in sections:
        messages = ", ".join(link(message["name"]) for message in section["messages"])
        say(f"- {link(section['name'])}{': ' + messages if messages else ''}", "  ")
    say("- Tables: " + ", ".join(map(link, TABLES)), "  ")
    print()


def main():
    sys.stdout.reconfigure(encoding="utf-8")
    root, bounce, bounced = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    sections = sections_of((root / "protocol/bounced.proto").read_text(encoding="utf-8"))
    rows = rows_of(root / "server/net/command")
    known = {message["name"] for section in sections for message in section["messages"]}
    check_anchors(sections)
    print("# Manual of the wire, made by make_manual.py: not to be changed by hand\n")
    print("What clients and daemon say to each other: from the comments of `bounced.proto`, the daemon's tables and its help texts.")
    print("How messages travel: [README.md](README.md); over HTTP and WebSocket: [server/net/http](../server/net/http/README.md).\n")
    print_contents(sections)
    for section in sections:
        print_section(section, known, rows)
    print_tables(sections, root, bounce, bounced)


if __name__ == "__main__":
    main()
